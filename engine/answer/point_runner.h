// What answers point queries on a device: a kernel with its buffers for each kind of query. Internal to engine/answer.
#pragma once

#include <algorithm>
#include <deque>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "engine/answer/coherent_order.h"
#include "engine/answer/inside_cells.h"
#include "engine/answer/point_order.h"
#include "engine/answer/query_filters.h"
#include "engine/answer/repair.h"
#include "engine/answer/stream.h"
#include "engine/core/parallel.h"

namespace ballot {

// Named, as PointQueries::Parts holds types of it.
namespace point_queries {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr std::size_t kFewPoints = 1024;  // fewer are not sorted

inline bool nearer(const Nearest& a, const Nearest& b) {
  if (a.prim == NO_HIT) return false;
  return b.prim == NO_HIT || a.distance < b.distance || (a.distance == b.distance && a.prim < b.prim);
}

/// A query of points: its kernel, and what a walk of pieces of the tree does with their answers.
struct NearestQuery {
  using Answer = Nearest;
  static constexpr std::uint32_t kBinding = BIND_HITS;
  static constexpr const char* kWhat = "closest points";
  static constexpr bool kHasCells = false;
  static Answer none() { return {{}, kInfinity, NO_HIT, 0, 0, 0}; }
  /// What one piece has found is the limit for the next.
  static void add(Answer& all, const Answer& piece, ProbePoint& asked) {
    if (!nearer(piece, all)) return;
    all = piece;
    asked.limit = piece.distance;
  }
};
struct InsideQuery {
  using Answer = std::uint32_t;
  static constexpr std::uint32_t kBinding = BIND_CROSSINGS;
  static constexpr const char* kWhat = "inside test";
  static constexpr bool kHasCells = true;
  static Answer none() { return 0; }
  static void add(Answer& all, const Answer& piece, ProbePoint&) {
    all = all == UNSURE || piece == UNSURE ? UNSURE : all ^ piece;
  }
};

struct WindingQuery {
  using Answer = float;
  static constexpr std::uint32_t kBinding = BIND_CROSSINGS;
  static constexpr const char* kWhat = "winding numbers";
  static constexpr bool kHasCells = false;
  static Answer none() { return 0; }
  static void add(Answer& all, const Answer& piece, ProbePoint&) { all += piece; }
};

/// Settles answers that the device leaves open. `words`: of the points, for filters. May be empty.
template <class Answer>
using Settle =
    std::function<void(std::span<const ProbePoint> points, const FilterWords& words, std::span<Answer> answers)>;

/// The words of points, for filters: in the host's memory, or on the device; or none.
struct WordsOf {
  const FilterWords* here = nullptr;
  const DeviceFilters* there = nullptr;
};

/// Runs one kind of query: in parts, with buffers that are kept.
template <class Kind>
class Runner {
 public:
  using Answer = typename Kind::Answer;
  using Launched = std::function<void(std::uint32_t done)>;

  /// `filters`: of a kernel with BALLOT_FILTERS, which have taken what it needs of the tree before it is asked.
  /// `order`: of the points, for a kernel with BALLOT_BLOCKS. Null for others. `cells`: for one with BALLOT_LISTED.
  Runner(Context& gpu, DeviceTree& tree, const char* kernel, Defines defines, QueryFilters* filters = nullptr,
         PointOrder* order = nullptr, InsideCells* cells = nullptr)
      : gpu_(gpu),
        tree_(tree),
        kernel_(gpu, tree, kernel, std::move(defines)),
        filters_(filters),
        order_(order),
        cells_(cells) {}

  /// Makes the kernel for the tree as it is now. What it reads in addition to tree and points is to be bound then.
  void prepare() {
    kernel_.prepare();
    if (filters_) filters_->bind_scene(kernel_);
  }
  void bind(std::uint32_t binding, const RawBuffer& buffer) { kernel_.bind(binding, buffer); }
  /// Returns the way in which the kernel reads what is not a record of points.
  Fetch fetch() const { return kernel_.fetch(); }
  /// Returns the largest number of points of one dispatch.
  std::uint32_t most() const { return kernel_.most(); }

  /// Answers the points of a stream.
  TraceTimes run(const Stream<ProbePoint, Answer>& stream, const Settle<Answer>& settle,
                 const FilterReaders& words = {}) {
    PointAnswerer answerer(*this, settle, words);
    return StreamRing::of(gpu_).run(stream, answerer);
  }

  /// Answers points [first, first + count) of an array on the device, at most most() of them, in their order: records
  /// that, or does it and waits. The host sees them only where the driver cut walks short, or something is left to
  /// settle. `given`: words of these points, or on the device of the array's.
  void run_there(const Buffer<ProbePoint>& points, Buffer<Answer>& answers, std::uint32_t first, std::uint32_t count,
                 const WordsOf& given, const Settle<Answer>& settle, TraceTimes& times, const Launched& launched = {}) {
    if (filters_ && given.here) filters_->bind(kernel_, count, *given.here, false);
    if (filters_ && given.there) filters_->bind_there(kernel_, *given.there, 0, std::size_t{first} + count);
    kernel_.bind(BIND_RAYS, points);
    kernel_.bind(Kind::kBinding, answers);
    put_in_order(points, first, count, times);
    const TreePiece whole{tree_.root()};
    std::uint32_t unfinished = 0;
    if constexpr (Kind::kHasCells) {
      if (cells_) {
        const std::uint32_t others = cells_->look_up(points, answers, first, count, times);
        cells_->bind(kernel_);
        unfinished = kernel_.run(others, whole, times);
      }
    }
    if (!cells_)
      unfinished = settle ? kernel_.run(first, count, whole, times, launched)
                          : kernel_.answer(first, count, whole, times, launched);
    if (!unfinished && !settle) return;
    std::vector<ProbePoint> asked(count);
    std::vector<Answer> found(count);
    points.download(asked, first);
    answers.download(found, first);
    FilterWords words = given.here ? *given.here : FilterWords();
    if (given.there) words = given.there->readers().read(first, count);
    if (unfinished) repair_cut(asked, words, std::span(found), times);
    if (settle) settle(asked, words, found);
    answers.upload(found, first);
  }

 private:
  /// The points of a stream. On a CPU device they go in an order in which neighbours are near each other: its lanes
  /// read nodes one by one, and a walk takes as long as that of its slowest lane.
  class PointAnswerer : public Answerer<ProbePoint, Answer> {
   public:
    PointAnswerer(Runner& runner, const Settle<Answer>& settle, const FilterReaders& words)
        : runner_(runner), settle_(settle), words_of_(words) {}
    std::size_t most() const override { return std::min<std::size_t>(runner_.most(), kChunk); }
    void arrange(std::span<ProbePoint> points) override {
      order_.clear();
      if (points.size() < kFewPoints || runner_.cells_) return;  // few are walked for
      order_points(points, runner_.tree_.bvh().bounds, order_);
      rearranged_.arrange(points, order_);
    }
    void answer(const Chunk<ProbePoint, Answer>& c, TraceTimes& times) override {
      FilterWords& words = words_.emplace_back(words_of_.read(c.first, c.here.size()));
      words.arrange(order_);
      // Of answers that the host settles none is done before.
      runner_.run_there(c.questions, c.answers, 0, c.count(), {.here = &words}, {}, times,
                        settle_ ? Launched() : c.launched);
    }
    std::span<const Answer> end(const Questions<ProbePoint>& points, std::span<Answer> answers) override {
      const FilterWords words = std::move(words_.front());
      words_.pop_front();
      if (settle_) settle_(points.all(), words, answers);
      return order_.empty() ? answers : rearranged_.back(answers, order_);
    }

   private:
    Runner& runner_;
    const Settle<Answer>& settle_;
    const FilterReaders& words_of_;
    std::deque<FilterWords> words_;     // of the chunks whose answers have not come yet
    std::vector<std::uint32_t> order_;  // of the chunk under way; empty: as they came
    Rearranged<ProbePoint, Answer> rearranged_;
  };

  void put_in_order(const Buffer<ProbePoint>& points, std::uint32_t first, std::uint32_t count, TraceTimes& times) {
    if (!order_ || count == 0) return;
    order_->record(points, first, count, tree_.bvh().bounds, [&times](double ms) { times.device_ms += ms; });
    order_->bind(kernel_);
  }

  void make_room(std::size_t count) {
    kernel_.bind(BIND_RAYS, buffer_for(points_, gpu_, count, "points"));
    kernel_.bind(Kind::kBinding, buffer_for(answers_, gpu_, count, "answers of points"));
  }

  /// The points of a part, in pieces of the tree.
  struct Walks {
    using Answer = typename Kind::Answer;
    static constexpr const char* kQueries = "points";

    Runner& runner;
    std::span<const ProbePoint> asked;
    const FilterWords& words;
    TraceTimes& times;
    std::vector<ProbePoint> chosen = {};
    FilterWords chosen_words = {};

    static Answer none() { return Kind::none(); }
    static std::string name() { return Kind::kWhat; }
    void choose(std::span<const std::uint32_t> numbers) {
      chosen.clear(), chosen_words = {};
      for (const std::uint32_t i : numbers) chosen.push_back(asked[i]), chosen_words.add(words, i);
    }
    std::vector<TreePiece> pieces(std::uint64_t limit) { return runner.kernel_.pieces(limit); }
    void ask(const TreePiece& piece, std::span<Answer> found) {
      runner.points_->upload(chosen);
      if (runner.filters_) runner.filters_->bind(runner.kernel_, chosen.size(), chosen_words, true);
      runner.put_in_order(*runner.points_, 0, std::uint32_t(chosen.size()), times);
      if (runner.cells_) runner.cells_->list_all(std::uint32_t(chosen.size())), runner.cells_->bind(runner.kernel_);
      runner.kernel_.run(std::uint32_t(chosen.size()), piece, times);
      runner.answers_->download(found);
    }
    void add(std::size_t k, Answer& all, const Answer& found) { Kind::add(all, found, chosen[k]); }
  };

  void repair_cut(std::span<const ProbePoint> asked, const FilterWords& words, std::span<Answer> answers,
                  TraceTimes& times) {
    make_room(asked.size());
    Walks walks{*this, asked, words, times};
    repair(walks, answers, kFirstPieces, gpu_, times);
  }

  Context& gpu_;
  DeviceTree& tree_;
  QueryKernel kernel_;
  QueryFilters* filters_;
  PointOrder* order_;
  InsideCells* cells_;
  std::unique_ptr<Buffer<ProbePoint>> points_;  // that are asked again, in pieces of the tree
  std::unique_ptr<Buffer<Answer>> answers_;
};

}  // namespace point_queries

}  // namespace ballot
