// Reads the questions of a call, rays and points, from the caller's memory, by all cores.
#pragma once

#include <array>
#include <limits>
#include <span>

#include "engine/api/row_order.h"
#include "engine/api/state.h"
#include "engine/core/parallel.h"
#include "shaders/shared/layout.h"
#include "shaders/shared/query.h"

namespace ballot::api {

constexpr std::size_t kChunk = 1 << 13;  // questions that a thread takes at a time

/// Records of Floats floats, one for each question, gathered from columns: three numbers and one, for each four floats.
/// Keeps the caller's pointers, but not those to numbers that stand for all questions: they are read at once.
template <std::size_t Floats>
class Columns {
 public:
  using Record = std::array<float, Floats>;
  struct Given {
    const char* name;
    const BallotColumn& column;
    bool needed;
  };

  /// `what` the questions are: "rays". What no column gives is as in `defaults`; a last number above `most` becomes
  /// `most`. Throws Refused if the description is wrong.
  Columns(const char* what, const std::size_t (&shape)[BALLOT_AXES], const Record& defaults, float most,
          const std::array<Given, Floats / 2>& given);

  std::size_t count() const { return count_; }
  /// The record, as far as it is the same for all.
  const Record& common() const { return common_; }
  /// Writes the records of `n` questions, from number `place` on.
  void read(std::size_t place, std::size_t n, Record* to) const;
  /// Returns where the records of all questions lie in the caller's memory, one behind the other; null if they do not.
  const Record* packed() const;

 private:
  struct Part {
    const char* data;  // null: it is common to all
    std::array<std::ptrdiff_t, BALLOT_AXES> stride;
    std::ptrdiff_t step;  // from one number to the next
    bool is_double;
  };

  Part part_of(const char* what, const Given& given, std::size_t number);
  void join_axes();
  bool holds_records() const;
  const char* entry(std::size_t part, const std::array<std::size_t, BALLOT_AXES>& index) const;

  std::size_t count_ = 1, axes_ = 0;
  std::array<std::size_t, BALLOT_AXES> shape_{};  // the last axis is the fastest
  std::array<Part, Floats / 2> parts_{};
  bool whole_ = false;  // the parts are records as they are wanted
  Record common_;
  float most_;
};

/// The masks of questions: a word for each, at any stride. Keeps the caller's pointer, but not that of a mask that
/// stands for all.
class MaskColumn {
 public:
  /// Throws Refused if the description is wrong. `count`: of the questions.
  MaskColumn(const char* what, const std::size_t (&shape)[BALLOT_AXES], std::size_t count, const BallotColumn& given);
  /// Returns false if none were given: all bits.
  explicit operator bool() const { return given_; }
  /// Writes the masks of questions from number `place` on.
  void read(std::size_t place, std::span<std::uint32_t> to) const;

 private:
  bool given_ = false;
  const char* data_ = nullptr;  // null: all have `common_`
  std::uint32_t common_ = 0;
  std::size_t axes_ = 0;
  std::array<std::size_t, BALLOT_AXES> shape_{};
  std::array<std::ptrdiff_t, BALLOT_AXES> stride_{};
};

/// The rays of a call.
class RayArray {
 public:
  /// Throws Refused if the description is wrong.
  explicit RayArray(const BallotRays& rays);
  std::size_t count() const { return columns_.count(); }
  /// Fills `rays` from number `first` of the array on. An infinite t_max becomes the largest float, which is no bound
  /// either.
  void read(std::size_t first, std::span<Ray> rays) const { read(RowOrder(), first, rays); }
  /// The same for the rays in an order.
  void read(const RowOrder& order, std::size_t first, std::span<Ray> rays) const;
  /// Returns the rays [first, first + count) where they lie, if they are records that read() would copy as they are;
  /// null if not.
  const Ray* in_place(std::size_t first, std::size_t count) const;
  const MaskColumn& masks() const { return masks_; }

 private:
  Columns<8> columns_;
  MaskColumn masks_;
};

/// The points of a call.
class PointArray {
 public:
  /// Throws Refused if the description is wrong, or a limit for all is not above 0, with `needs_limit` is below 0 or is
  /// none.
  explicit PointArray(const BallotPoints& points, bool needs_limit = false);
  std::size_t count() const { return columns_.count(); }
  void read(std::uint64_t first, std::span<ProbePoint> points) const;
  const MaskColumn& masks() const { return masks_; }

 private:
  Columns<4> columns_;
  MaskColumn masks_;
};

}  // namespace ballot::api
