// Triangles that share a corner, and those of one plane, are found to be apart by signs alone: a triangle passes
// through another only if each has corners on both sides of the other's plane.
#include "engine/oracle/self_crossings.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/vector_relational.hpp>
#include <mutex>
#include <optional>

#include "engine/core/parallel.h"
#include "engine/oracle/predicates.h"
#include "engine/oracle/walker.h"
#include "engine/tree/host/bvh.h"

namespace ballot {
namespace {

using CrossingPairs = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

constexpr std::size_t kLeastRound = 16, kMostRound = 1024;  // triangles after which the bounds are looked at
constexpr std::size_t kCrossingChunk = 16;                  // of these, what a thread takes at a time
constexpr std::size_t kNamedPairs = 10;
constexpr std::uint64_t kLooks = 1 << 26, kLooksEach = 1 << 10;  // in all, and more for each triangle
constexpr std::uint64_t kLooksOfRound = 1 << 22, kLooksOfOne = 1 << 24, kLooksBetweenCalls = 1 << 16;
constexpr std::uint64_t kExactLooks = 64;         // that integers count for
constexpr std::size_t kCrossingsOfOne = 1 << 14;  // at most for one triangle
constexpr double kBuildShare = 0.1;               // of the progress

/// Returns the sign of the volume of four points. Adds to `looks` what integers count for.
int side_of(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, const glm::vec3& d, std::uint64_t& looks) {
  bool by_integers = false;
  const int sign = volume_sign(a, b, c, d, &by_integers);
  if (by_integers) looks += kExactLooks;
  return sign;
}

/// Sets the sides of b's corners at the plane of a. Returns true if there are some on both sides.
bool straddles(const Triangle& a, const Triangle& b, int (&sides)[3], std::uint64_t& looks) {
  for (std::size_t i = 0; i < 3; ++i) sides[i] = side_of(a[0], a[1], a[2], b[i], looks);
  const auto [least, most] = std::minmax({sides[0], sides[1], sides[2]});
  return least < 0 && most > 0;
}

/// Returns true if an edge of a passes through the inside of b. `sides`: of a's corners at the plane of b.
bool edge_passes(const Triangle& a, const int (&sides)[3], const Triangle& b, std::uint64_t& looks) {
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t k = (i + 1) % 3;
    if (sides[i] * sides[k] >= 0) continue;
    const auto side = [&](std::size_t m, std::size_t n) { return side_of(a[i], a[k], b[m], b[n], looks); };
    const int first = side(0, 1);
    if (first != 0 && side(1, 2) == first && side(2, 0) == first) return true;
  }
  return false;
}

bool pass_through(const Triangle& a, const Triangle& b, std::uint64_t& looks) {
  int of_a[3], of_b[3];
  return straddles(a, b, of_b, looks) && straddles(b, a, of_a, looks) &&
         (edge_passes(a, of_a, b, looks) || edge_passes(b, of_b, a, looks));
}

struct Box {
  explicit Box(const Triangle& t)
      : lo(glm::min(t[0], glm::min(t[1], t[2]))), hi(glm::max(t[0], glm::max(t[1], t[2]))) {}
  bool meets(const glm::vec3& other_lo, const glm::vec3& other_hi) const {
    return glm::all(glm::lessThanEqual(lo, other_hi)) && glm::all(glm::lessThanEqual(other_lo, hi));
  }
  glm::vec3 lo, hi;
  double t_min = 0;
};

std::optional<double> enter(const Box& box, const Bounds& node, double) {
  return box.meets(node.lo, node.hi) ? std::optional(0.0) : std::nullopt;
}

/// What a search has found so far. Several threads add to it.
class CrossingSearch {
 public:
  /// Keeps references to all arguments.
  CrossingSearch(std::span<const Triangle> triangles, const Bvh& tree, const Progress& progress)
      : triangles_(triangles), tree_(tree), progress_(progress) {}

  /// Looks at round after round of triangles, until all are done or a bound is met. Bounds are looked at between rounds
  /// alone, so that threads do not matter.
  void run() {
    std::size_t round = kLeastRound;
    while (done_ < triangles_.size()) {
      if (pairs_.size() >= kMostCrossingPairs || looks_ >= kLooks + kLooksEach * triangles_.size()) break;
      const std::size_t first = done_, size = std::min(round, triangles_.size() - first);
      const std::uint64_t before = looks_;
      for_chunks(size, kCrossingChunk, [&](std::size_t begin, std::size_t end) { look(first + begin, first + end); });
      const std::uint64_t of_each = std::max<std::uint64_t>(1, (looks_ - before) / size);
      round = std::clamp<std::size_t>(kLooksOfRound / of_each, kLeastRound, kMostRound);
    }
    whole_ = whole_ && done_ == triangles_.size();
  }

  SelfCrossings result() {
    SelfCrossings found;
    found.pairs = pairs_.size(), found.whole = whole_;
    std::ranges::sort(pairs_);
    for (const auto& [a, b] : pairs_) found.prims.push_back(a), found.prims.push_back(b);
    std::ranges::sort(found.prims);
    found.prims.erase(std::unique(found.prims.begin(), found.prims.end()), found.prims.end());
    pairs_.resize(std::min(kNamedPairs, pairs_.size()));
    found.first = std::move(pairs_);
    return found;
  }

 private:
  void tell(std::size_t more) {
    const std::lock_guard lock(mutex_);
    done_ += more;
    if (progress_) progress_(kBuildShare + (1 - kBuildShare) * double(done_) / double(triangles_.size()));
  }

  /// Looks for triangles beyond number i that pass through it. Returns false if it met a bound.
  bool look_at(std::size_t i, Walker<Bvh>& walker, CrossingPairs& mine, std::uint64_t& all_looks) {
    const Box box(triangles_[i]);
    const std::size_t before = mine.size();
    std::uint64_t looks = 0, told = 0;
    bool all = true;
    walker.walk(box, 0.0, [&](std::uint32_t prim) {
      if (looks >= kLooksOfOne || mine.size() - before >= kCrossingsOfOne) return all = false;
      ++looks;
      if (looks - told >= kLooksBetweenCalls) told = looks, tell(0);
      if (prim <= i) return true;
      const Box other(triangles_[prim]);
      if (box.meets(other.lo, other.hi) && pass_through(triangles_[i], triangles_[prim], looks))
        mine.emplace_back(std::uint32_t(i), prim);
      return true;
    });
    all_looks += looks;
    return all;
  }

  void look(std::size_t begin, std::size_t end) {
    CrossingPairs mine;
    Walker walker(tree_);
    std::uint64_t looks = 0;
    bool all = true;
    for (std::size_t i = begin; i < end; ++i) all = look_at(i, walker, mine, looks) && all;
    {
      const std::lock_guard lock(mutex_);
      pairs_.insert(pairs_.end(), mine.begin(), mine.end());
      looks_ += looks;
      whole_ = whole_ && all;
    }
    tell(end - begin);
  }

  std::span<const Triangle> triangles_;
  const Bvh& tree_;
  const Progress& progress_;
  std::mutex mutex_;
  CrossingPairs pairs_;
  std::uint64_t looks_ = 0;
  std::size_t done_ = 0;
  bool whole_ = true;
};

}  // namespace

bool pass_through(const Triangle& a, const Triangle& b) {
  std::uint64_t looks = 0;
  return pass_through(a, b, looks);
}

SelfCrossings self_crossings(std::span<const Triangle> triangles, const Progress& progress) {
  const Bvh bvh = build_bvh(triangles, {.builder = BuilderId::Balanced}, [&](double share) {
    if (progress) progress(kBuildShare * share);
  });
  CrossingSearch search(triangles, bvh, progress);
  search.run();
  return search.result();
}

}  // namespace ballot
