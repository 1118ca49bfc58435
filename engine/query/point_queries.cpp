#include "engine/query/point_queries.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/parallel.h"
#include "engine/oracle/closest.h"
#include "engine/oracle/crossings.h"
#include "engine/query/coherent_order.h"
#include "engine/query/query_kernel.h"

namespace ballot {

// Named, as PointQueries::Parts holds types of it.
namespace point_queries {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr std::size_t kMoved = 1 << 14;   // points that a thread moves at a time
constexpr std::size_t kFewPoints = 1024;  // fewer are not sorted
constexpr std::size_t kSettled = 256;     // points that a thread settles at a time

inline bool nearer(const Nearest& a, const Nearest& b) {
  if (a.prim == NO_HIT) return false;
  return b.prim == NO_HIT || a.distance < b.distance || (a.distance == b.distance && a.prim < b.prim);
}

inline bool is_cut_short(const Nearest& a) { return a.prim == UNFINISHED; }
inline bool is_cut_short(std::uint32_t a) { return a == UNFINISHED; }

/// A query of points: its kernel, and what a walk of pieces of the tree does with their answers.
struct NearestQuery {
  using Answer = Nearest;
  static constexpr std::uint32_t kBinding = BIND_HITS;
  static constexpr const char* kWhat = "closest points";
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
  static Answer none() { return 0; }
  static void add(Answer& all, const Answer& piece, ProbePoint&) {
    all = all == UNSURE || piece == UNSURE ? UNSURE : all ^ piece;
  }
};

/// Runs one kind of query: in parts, with buffers that are kept.
template <class Kind>
class Runner {
 public:
  using Answer = typename Kind::Answer;
  /// Settles answers that the device leaves open.
  using Settle = std::function<void(std::span<const ProbePoint> points, std::span<Answer> answers)>;

  Runner(Context& gpu, DeviceTree& tree, const char* kernel, Defines defines = {})
      : gpu_(gpu), tree_(tree), kernel_(gpu, tree, kernel, std::move(defines)) {}

  template <class Take>
  TraceTimes run(const PointStream& stream, const Take& take, const Settle& settle) {
    TraceTimes times;
    if (stream.count == 0) return times;
    const PassScope scope(gpu_);
    kernel_.prepare();
    const std::size_t chunk = std::size_t(std::min<std::uint64_t>(stream.count, kernel_.most()));
    make_room(chunk);
    std::vector<ProbePoint> asked(chunk);
    std::vector<Answer> found(chunk);
    for (std::uint64_t first = 0; first < stream.count; first += chunk) {
      const std::size_t some = std::size_t(std::min<std::uint64_t>(chunk, stream.count - first));
      const std::span<ProbePoint> part = std::span(asked).first(some);
      const std::span<Answer> result = std::span(found).first(some);
      stream.read(first, part);
      answer(part, result, times);
      if (settle) settle(part, result);
      take(first, std::span<const Answer>(result));
      if (stream.progress) stream.progress(first + some);
    }
    return times;
  }

 private:
  /// Answers points. On a CPU device they go in an order in which neighbours are near each other: its lanes read nodes
  /// one by one, and a walk takes as long as that of its slowest lane.
  void answer(std::span<const ProbePoint> asked, std::span<Answer> result, TraceTimes& times) {
    if (!gpu_.info().is_cpu() || asked.size() < kFewPoints) {
      answer_in_order(asked, result, times);
      return;
    }
    order_points(asked, tree_.bvh().bounds, order_);
    sorted_.resize(asked.size()), found_.resize(asked.size());
    for_chunks(asked.size(), kMoved, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) sorted_[i] = asked[order_[i]];
    });
    answer_in_order(sorted_, found_, times);
    for_chunks(asked.size(), kMoved, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) result[order_[i]] = found_[i];
    });
  }

  void answer_in_order(std::span<const ProbePoint> asked, std::span<Answer> result, TraceTimes& times) {
    points_->upload(asked);
    const std::uint32_t unfinished = kernel_.run(std::uint32_t(asked.size()), tree_.root(), times);
    answers_->download(result);
    if (unfinished) repair(asked, result, times);
  }

  void make_room(std::size_t count) {
    if (!points_ || points_->size() < count) {
      points_.reset(), answers_.reset();
      points_.emplace(gpu_, count, Access::Storage, "points");
      answers_.emplace(gpu_, count, Access::Storage, "answers of points");
    }
    kernel_.bind(BIND_RAYS, *points_);
    kernel_.bind(Kind::kBinding, *answers_);
  }

  /// Asks again for points whose walk the driver cut short, in ever smaller pieces of the tree.
  void repair(std::span<const ProbePoint> asked, std::span<Answer> answers, TraceTimes& times) {
    std::vector<std::uint32_t> open;
    for (std::uint32_t i = 0; i < answers.size(); ++i)
      if (is_cut_short(answers[i])) open.push_back(i);
    times.retraced += open.size();
    for (const std::uint64_t limit : {8192ull, 1024ull, 128ull, 16ull, 0ull}) {
      open = repair_pieces(asked, answers, open, limit, times);
      if (open.empty()) return;
    }
    fail(Failure::Work, "{}: {} points could not be finished on {}: its driver stops loops after a few iterations",
         Kind::kWhat, open.size(), gpu_.info().name);
  }

  /// Returns the points that are still open.
  std::vector<std::uint32_t> repair_pieces(std::span<const ProbePoint> asked, std::span<Answer> answers,
                                           const std::vector<std::uint32_t>& open, std::uint64_t limit,
                                           TraceTimes& times) {
    std::vector<ProbePoint> part;
    for (const std::uint32_t i : open) part.push_back(asked[i]);
    std::vector<Answer> found(part.size()), all(part.size(), Kind::none());
    std::vector<bool> cut(part.size(), false);
    for (const std::uint32_t root : kernel_.pieces(limit)) {
      points_->upload(part);
      kernel_.run(std::uint32_t(part.size()), root, times);
      answers_->download(found);
      for (std::size_t k = 0; k < part.size(); ++k) {
        cut[k] = cut[k] || is_cut_short(found[k]);
        if (!cut[k]) Kind::add(all[k], found[k], part[k]);
      }
    }
    std::vector<std::uint32_t> still;
    for (std::size_t k = 0; k < open.size(); ++k)
      if (cut[k])
        still.push_back(open[k]);
      else
        answers[open[k]] = all[k];
    return still;
  }

  Context& gpu_;
  DeviceTree& tree_;
  QueryKernel kernel_;
  std::optional<Buffer<ProbePoint>> points_;
  std::optional<Buffer<Answer>> answers_;
  std::vector<std::uint32_t> order_;
  std::vector<ProbePoint> sorted_;
  std::vector<Answer> found_;
};

inline PointStream stream_of(std::span<const ProbePoint> points, std::size_t room) {
  if (points.size() != room)
    fail(Failure::Arguments, "point query: {} points, but room for {} answers", points.size(), room);
  PointStream stream;
  stream.count = points.size();
  stream.read = [points](std::uint64_t first, std::span<ProbePoint> part) {
    std::copy_n(points.begin() + std::ptrdiff_t(first), part.size(), part.begin());
  };
  return stream;
}

/// Replaces answers by those of the exact nearest triangles.
inline void settle_nearest(DeviceTree& tree, std::span<const ProbePoint> points, std::span<Nearest> answers) {
  const ExactClosestPoints oracle(tree.any_pairs());
  const std::span<const Triangle> triangles = tree.triangles();
  for_chunks(points.size(), kSettled, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      std::pair<std::uint32_t, Triangle> near(answers[i].prim, {});
      if (near.first != NO_HIT) near.second = triangles[near.first];
      const ExactClosest found = oracle.nearest(points[i].at, points[i].limit, near.first == NO_HIT ? nullptr : &near);
      answers[i] =
          found.prim == NO_HIT ? NearestQuery::none() : Nearest{glm::vec3(found.at), float(found.distance), found.prim,
                                                                float(found.u),      float(found.v),        0};
    }
  });
}

inline void settle_inside(DeviceTree& tree, std::span<const ProbePoint> points, std::span<std::uint32_t> answers) {
  const ExactCrossings oracle(tree.any_pairs());
  for_chunks(points.size(), kSettled, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      if (answers[i] == UNSURE) answers[i] = oracle.inside(points[i].at);
  });
}

}  // namespace point_queries

struct PointQueries::Parts {
  /// Parity needs each triangle once, so that query walks a tree without spatial splits.
  Parts(Context& device, DeviceTree& tree)
      : gpu(device), scene(tree), closest(device, tree, "closest_point"), whole(device, tree) {}

  Context& gpu;
  DeviceTree& scene;
  point_queries::Runner<point_queries::NearestQuery> closest;
  WholeTree whole;
  std::optional<point_queries::Runner<point_queries::InsideQuery>> inside, exact_inside;
};

PointQueries::PointQueries(Context& gpu, DeviceTree& tree) : parts_(std::make_unique<Parts>(gpu, tree)) {}
PointQueries::~PointQueries() = default;

TraceTimes PointQueries::nearest(const PointStream& stream, const TakeNearest& take, const PointQuery& query) {
  Parts& parts = *parts_;
  if (!query.exact) return parts.closest.run(stream, take, {});
  return parts.closest.run(stream, take, [&](std::span<const ProbePoint> points, std::span<Nearest> answers) {
    point_queries::settle_nearest(parts.scene, points, answers);
  });
}

TraceTimes PointQueries::nearest(std::span<const ProbePoint> points, std::span<Nearest> answers,
                                 const PointQuery& query) {
  return nearest(
      point_queries::stream_of(points, answers.size()),
      [&](std::uint64_t first, std::span<const Nearest> found) {
        std::ranges::copy(found, answers.begin() + std::ptrdiff_t(first));
      },
      query);
}

TraceTimes PointQueries::inside(const PointStream& stream, const TakeInside& take, const PointQuery& query) {
  Parts& parts = *parts_;
  if (parts.whole.update()) parts.inside.reset(), parts.exact_inside.reset();
  auto& runner = query.exact ? parts.exact_inside : parts.inside;
  if (!runner) runner.emplace(parts.gpu, parts.whole.tree(), "inside", Defines{{"BALLOT_EXACT", int(query.exact)}});
  if (!query.exact) return runner->run(stream, take, {});
  return runner->run(stream, take, [&](std::span<const ProbePoint> points, std::span<std::uint32_t> answers) {
    point_queries::settle_inside(parts.whole.tree(), points, answers);
  });
}

TraceTimes PointQueries::inside(std::span<const ProbePoint> points, std::span<std::uint32_t> answers,
                                const PointQuery& query) {
  return inside(
      point_queries::stream_of(points, answers.size()),
      [&](std::uint64_t first, std::span<const std::uint32_t> found) {
        std::ranges::copy(found, answers.begin() + std::ptrdiff_t(first));
      },
      query);
}

}  // namespace ballot
