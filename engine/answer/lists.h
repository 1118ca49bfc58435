// Streams of questions whose answers are lists of any length. Internal to engine/answer.
//
// A first walk numbers the records of each question and writes them to a row of a few. On a GPU the device then sums
// the numbers up, walks again for questions whose list is longer than a row, puts each list in order, one after the
// other, and carries them to the host, no more than there are: all that beside the work of the host on other chunks. On
// a CPU device the host takes the rows. Either way the host settles what is left open. Lists of arrays on the device go
// through the same stages (list_stages.h), and stay there (list_there.h).
#pragma once

#include <array>
#include <deque>

#include "engine/answer/filters.h"
#include "engine/answer/query_kernel.h"
#include "engine/answer/stream.h"

namespace ballot {

inline bool before(const Hit& a, const Hit& b) { return a.t != b.t ? a.t < b.t : a.prim < b.prim; }
inline bool before(const Within& a, const Within& b) {
  return a.distance != b.distance ? a.distance < b.distance : a.prim < b.prim;
}

/// Questions that are asked together.
template <class Question>
struct ListPart {
  std::vector<Question> questions;
  FilterWords words;  // of each

  std::size_t size() const { return questions.size(); }
  void add(std::span<const Question> from, const FilterWords& words_of, std::size_t i) {
    questions.push_back(from[i]);
    words.add(words_of, i);
  }
};

/// What a kernel is for. Rows: writes the first records of each question to its row. Rest: lists those that do not fit.
/// Apart: lists all. Numbers: lists nothing. The latter two are for whole trees or pieces of them.
enum class ListForm { Rows, Rest, Apart, Numbers };

/// A kind of list: what finds the records of a question, and what the host adds.
template <class Question, class Record>
class ListKind {
 public:
  virtual ~ListKind() = default;
  /// Returns the number of records of a row.
  virtual std::uint32_t row() const { return 8; }
  /// Returns false if no list is longer than a row.
  virtual bool has_rest() const { return true; }
  /// Returns the most records of a list that are wanted: the first ones.
  virtual std::uint32_t most() const { return ~0u; }
  /// Returns a kernel with all bound that it reads besides questions and words of theirs. Rest: the words that were
  /// bound last are bound too.
  virtual QueryKernel& kernel(ListForm form, bool pieces) = 0;
  virtual std::vector<TreePiece> pieces(std::uint64_t limit) = 0;
  virtual TreePiece whole() = 0;
  /// Writes an order in which neighbours are alike. Returns false, and no order, if they are so already.
  virtual bool order(std::span<const Question> questions, std::vector<std::uint32_t>& order) = 0;
  /// Returns the words of questions that filters read.
  virtual FilterWords words(std::uint64_t, std::size_t) { return {}; }
  /// Binds those of the questions that are asked next. `apart`: those of a stream stay as they are.
  virtual void bind_words(QueryKernel&, std::size_t, const FilterWords&, bool) {}
  /// The same for `count` questions on the device from number `first` on.
  virtual void bind_words_there(QueryKernel&, std::uint64_t, std::size_t) {}
  /// Returns the lists of questions that are UNSURE.
  virtual std::vector<std::vector<Record>> settle(const ListPart<Question>&) { return {}; }
  /// Returns true if the device's order is not that of put_in_order().
  virtual bool reorders() const { return false; }
  /// Puts a list in order. Thread-safe.
  virtual void put_in_order(const Question&, std::vector<Record>& list) const {
    std::ranges::sort(list, [](const Record& a, const Record& b) { return before(a, b); });
  }
};

/// The buffers and kernels of lists. They are kept for the next stream.
template <class Question, class Record>
struct ListRooms {
  struct Room {
    std::unique_ptr<Buffer<Record>> records;
    std::unique_ptr<Buffer<Record>> here;  // the host's side, on a device with memory of its own
  };
  std::array<Room, 3> rooms;  // of chunks under way
  std::uint32_t records = 0;  // of a room
  std::unique_ptr<Kernel> sums, order;
  // Of lists that stay on the device.
  std::unique_ptr<Kernel> appends, long_order, pick, widen, alone;
  std::unique_ptr<Buffer<AppendedLists>> appended, part;
  std::unique_ptr<Buffer<std::uint32_t>> whole_places;
  std::unique_ptr<Buffer<std::int64_t>> offsets;
  std::unique_ptr<Buffer<Record>> rows;
  std::unique_ptr<Buffer<std::uint32_t>> places, tiles;
  // Of questions that are asked apart.
  std::unique_ptr<Buffer<Question>> questions;
  std::unique_ptr<Buffer<std::uint32_t>> numbers, places_apart;
  std::unique_ptr<Buffer<Record>> records_apart;
  // What the host has put in order. Memory that stays is not written twice.
  std::vector<std::uint32_t> counts;
  std::vector<Record> lists;
};

/// `of`: PLACES_.... `of_long`: of lists that a workgroup puts in order.
KernelSource places_source(int of);
KernelSource order_source(std::uint32_t record_words, bool of_long = false);
/// `widens`: makes hits of triangles within radii.
KernelSource pick_source(bool widens = false);

}  // namespace ballot

#include "engine/answer/list_stages.h"  // the templates
//
#include "engine/answer/list_answerer.h"
