// Columns of questions in the caller's memory: their checks, and the walk over their strides.
#pragma once

#include <array>
#include <bit>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <type_traits>

#include "engine/answer/made_questions.h"
#include "engine/api/row_order.h"
#include "engine/api/state.h"

namespace ballot::api {

constexpr unsigned kMostNumbers = 12;  // of a question in a column

/// The shape of questions. The last axis is the fastest.
struct Shape {
  std::array<std::size_t, BALLOT_AXES> lengths{};
  std::size_t axes = 0, count = 1;
};
/// Throws Refused if there is no memory for so many. `what` they are: "rays".
Shape read_shape(const char* what, const std::size_t (&shape)[BALLOT_AXES]);

/// Numbers of questions in the caller's memory.
struct Column {
  unsigned numbers = 1;  // of each question
  bool is_given = false, is_double = false;
  const char* data = nullptr;                        // null: it is not given, or all have `own`
  std::array<std::ptrdiff_t, BALLOT_AXES> stride{};  // 0 along axes of one entry
  std::ptrdiff_t step = sizeof(float);               // from one number to the next
  std::array<std::uint32_t, kMostNumbers> own{};     // the bits of float32 numbers, or words
  std::array<double, kMostNumbers> own_doubles{};    // the same numbers as they were given

  float own_number(unsigned k) const { return std::bit_cast<float>(own[k]); }
  /// Reads a number of a question, rounded to float32.
  float number(const char* question, unsigned k) const {
    const char* from = question + std::ptrdiff_t(k) * step;
    if (!is_double) {
      float number;
      std::memcpy(&number, from, sizeof number);
      return number;
    }
    double number;
    std::memcpy(&number, from, sizeof number);
    return float(number);
  }
};

/// A column as it is described: its name, and what it has to be.
struct Described {
  const char* what;  // the questions: "rays"
  const char* name;
  unsigned numbers = 1;
  bool needed = false, words = false;  // words: uint32, not numbers
};
/// Reads what is the same for all questions. Throws Refused if the description is wrong.
Column read_column(const Described& described, const Shape& shape, const BallotColumn& given);

/// A column that is walked by itself.
class Lane {
 public:
  Lane() = default;
  Lane(const Column& column, const Shape& shape);

  /// Returns false if the column is not given.
  explicit operator bool() const { return column_.is_given; }
  const Column& column() const { return column_; }
  /// Calls work(i, count, from, stride) for runs that cover questions [place, place + n): the numbers of `count`
  /// questions, place + i and those after it, lie at `from`, `stride` bytes apart. The column varies.
  template <class Work>
  void for_runs(std::size_t place, std::size_t n, const Work& work) const {
    const std::size_t last = shape_.axes - 1, length = shape_.lengths[last];
    for (std::size_t i = 0; i < n;) {
      const char* from = column_.data;
      std::size_t index = place + i;
      const std::size_t some = std::min(n - i, length - index % length);
      for (std::size_t a = last + 1; a-- > 0; index /= shape_.lengths[a])
        from += std::ptrdiff_t(index % shape_.lengths[a]) * column_.stride[a];
      work(i, some, from, column_.stride[last]);
      i += some;
    }
  }
  /// Calls put(i, numbers) for questions [place, place + n) with the numbers of each, as they were given. Nothing if
  /// the column is not given.
  template <class Put>
  void for_doubles(std::size_t place, std::size_t n, const Put& put) const {
    std::array<double, kMostNumbers> numbers = column_.own_doubles;
    if (!column_.data) {
      for (std::size_t i = 0; column_.is_given && i < n; ++i) put(i, numbers);
      return;
    }
    const auto walk = [&]<class Number>(Number number, const auto count) {
      for_runs(place, n, [&](std::size_t i, std::size_t some, const char* from, std::ptrdiff_t stride) {
        for (const std::size_t end = i + some; i < end; ++i, from += stride) {
          for (unsigned k = 0; k < count; ++k) {
            std::memcpy(&number, from + std::ptrdiff_t(k) * column_.step, sizeof number);
            numbers[k] = number;
          }
          put(i, numbers);
        }
      });
    };
    constexpr std::integral_constant<unsigned, 3> kVector;
    if (column_.is_double)
      column_.numbers == kVector ? walk(double(), kVector) : walk(double(), column_.numbers);
    else
      column_.numbers == kVector ? walk(float(), kVector) : walk(float(), column_.numbers);
  }
  /// Returns the lane of its entries alone: those that questions share are there once.
  Lane entries() const;
  std::size_t count() const { return shape_.count; }

 private:
  Column column_;
  Shape shape_;  // with as few axes as it can be walked by
};

/// Records of Floats floats, one for each question, gathered from columns: three numbers and one, for each four floats.
template <std::size_t Floats>
class Columns {
 public:
  using Record = std::array<float, Floats>;

  /// What no column gives is as in `defaults`; a last number above `most` becomes `most`.
  Columns(const Shape& shape, const std::array<Column, Floats / 2>& columns, const Record& defaults, float most);

  /// The record, as far as it is the same for all.
  const Record& common() const { return common_; }
  /// Writes the records of `n` questions, from number `place` on.
  void read(std::size_t place, std::size_t n, Record* to) const;
  /// Returns where the records of all questions lie in the caller's memory, one behind the other; null if they do not.
  const Record* packed() const;

 private:
  void join_axes(const Shape& shape);
  bool holds_records() const;
  const char* entry(std::size_t part, const std::array<std::size_t, BALLOT_AXES>& index) const;

  std::size_t axes_ = 0;
  std::array<std::size_t, BALLOT_AXES> shape_{};
  std::array<Column, Floats / 2> parts_{};
  bool whole_ = false;  // the parts are records as they are wanted
  Record common_;
  float most_;
};

/// Returns the tables that a device makes `kind` of questions of, in their order: what the columns have, each entry
/// once. None if they take more than a part of what the questions do, or more memory than they should. `most`: the
/// largest number of the last column but for poses, as in Columns; `defaults`: the first number of columns that are not
/// given.
struct TableOf {
  const Column& column;
  std::array<float, 3> absent = {};
  float most = std::numeric_limits<float>::infinity();
};
std::optional<QuestionTables> tables_of(Made kind, const Shape& shape, const RowOrder& order,
                                        std::span<const TableOf> columns);

}  // namespace ballot::api
