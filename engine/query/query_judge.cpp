#include "engine/query/query_judge.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <mutex>

#include "engine/core/parallel.h"
#include "engine/oracle/closest.h"
#include "engine/oracle/crossings.h"

namespace ballot {

namespace {

constexpr double kRoundoff = 0x1p-24;
constexpr std::size_t kJudgedChunk = 256;

/// Sums what judge(begin, end) returns over chunks of [0, count), on all cores.
template <class Judge>
auto sum_over(std::size_t count, const Judge& judge) {
  decltype(judge(0, 0)) all;
  std::mutex mutex;
  for_chunks(count, kJudgedChunk, [&](std::size_t begin, std::size_t end) {
    const auto some = judge(begin, end);
    const std::lock_guard lock(mutex);
    all += some;
  });
  return all;
}

/// A triangle as a ray sees it, in double precision, and the bounds of shaders/lib/query/sure.glsl.
struct Seen {
  Seen(const Ray& ray, const Triangle& triangle) {
    const glm::dvec3 d(ray.dir), size = glm::abs(d);
    const int m = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2, a = (m + 1) % 3, b = (m + 2) % 3;
    double x[3], y[3], z[3], most = 0, far = 0;
    for (int i = 0; i < 3; ++i) {
      const glm::dvec3 p = glm::dvec3(triangle[std::size_t(i)]) - glm::dvec3(ray.origin);
      z[i] = p[m];
      x[i] = p[a] - p[m] * d[a] / d[m], y[i] = p[b] - p[m] * d[b] / d[m];
      most = std::max({most, std::abs(x[i]), std::abs(y[i])}), far = std::max(far, std::abs(z[i]));
    }
    const double moved = 16 * kRoundoff * (most + far), room = moved * (4 * most + 2 * moved);
    double side[3], det = 0, depth = 0;
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      side[i] = x[k] * y[j] - y[k] * x[j];
      det += side[i], depth += side[i] * z[i];
    }
    const double least = std::min({side[0], side[1], side[2]}), largest = std::max({side[0], side[1], side[2]});
    crossed = least > room || largest < -room;
    missed = least < -room && largest > room;
    const double left = std::abs(det) - 3 * room, span = *std::ranges::max_element(z) - *std::ranges::min_element(z);
    t = depth / det / d[m];
    t_off = left > 0 ? (3 * room / left * span + 32 * kRoundoff * far) / size[m] : INFINITY;
  }

  /// Returns true if rounding within the bound may decide about the crossing.
  bool open(const Ray& ray) const {
    if (missed) return false;
    if (!crossed) return true;
    return std::abs(t - ray.t_min) <= t_off || std::abs(t - ray.t_max) <= t_off;
  }

  bool crossed, missed;
  double t, t_off;
};

double reach_of(const glm::vec3& p, const Triangle& t) {
  double most = 0;
  for (const glm::vec3& v : t) most = std::max(most, glm::length(glm::dvec3(v) - glm::dvec3(p)));
  return most;
}

/// Returns true if a list differs from the exact one by no more than the bounds allow.
bool within_bounds(const Ray& ray, std::span<const Triangle> triangles, std::span<const Hit> found,
                   const std::vector<ExactCrossing>& exact) {
  std::vector<std::pair<std::uint32_t, double>> a, b;
  for (const Hit& h : found) a.emplace_back(h.prim, h.t);
  for (const ExactCrossing& c : exact) b.emplace_back(c.prim, c.t);
  std::ranges::sort(a), std::ranges::sort(b);
  std::size_t i = 0, k = 0;
  while (i < a.size() || k < b.size()) {
    if (i < a.size() && k < b.size() && a[i].first == b[k].first) {
      const Seen seen(ray, triangles[a[i].first]);
      if (!(std::abs(a[i].second - b[k].second) <= seen.t_off)) return false;
      ++i, ++k;
      continue;
    }
    const bool ours = k == b.size() || (i < a.size() && a[i].first < b[k].first);
    if (!Seen(ray, triangles[ours ? a[i++].first : b[k++].first]).open(ray)) return false;
  }
  return true;
}

/// Where the crossings of each ray begin.
class Starts {
 public:
  explicit Starts(const ListedCrossings& lists) : lists_(lists) {
    for (const std::uint32_t n : lists.counts) first_.push_back(first_.back() + n);
  }
  std::span<const Hit> of(std::size_t ray) const {
    return std::span(lists_.hits).subspan(first_[ray], lists_.counts[ray]);
  }

 private:
  const ListedCrossings& lists_;
  std::vector<std::size_t> first_{0};
};

bool is_same(std::span<const Hit> found, std::span<const ExactCrossing> exact) {
  return std::ranges::equal(found, exact, {}, &Hit::prim, &ExactCrossing::prim);
}

}  // namespace

RayErrors& RayErrors::operator+=(const RayErrors& other) {
  counts += other.counts, lists += other.lists, first += other.first;
  return *this;
}

QueryErrors& QueryErrors::operator+=(const QueryErrors& other) {
  checked += other.checked, wrong += other.wrong, beyond += other.beyond;
  return *this;
}

QueryJudge::QueryJudge(DeviceTree& tree) : tree_(tree.any_pairs()), triangles_(tree.triangles()) {}

RayErrors QueryJudge::rays(std::span<const Ray> rays, const RayAnswers& found) const {
  const Starts lists(found.lists), first(found.first);
  const ExactCrossings oracle(tree_);
  return sum_over(rays.size(), [&](std::size_t begin, std::size_t end) {
    RayErrors errors;
    for (std::size_t i = begin; i < end; ++i) {
      const std::span<const Hit> mine = lists.of(i);
      const std::vector<ExactCrossing> exact = oracle.list(rays[i]);
      errors.lists += {1, !is_same(mine, exact), !within_bounds(rays[i], triangles_, mine, exact)};
      if (!found.counts.empty()) errors.counts += {1, found.counts[i] != exact.size(), found.counts[i] != mine.size()};
      if (found.first.counts.empty()) continue;
      const auto beginning = [&](const auto& all) {
        return std::span(all).first(std::min<std::size_t>(found.most, all.size()));
      };
      const std::span<const Hit> some = first.of(i);
      errors.first +=
          {1, !is_same(some, beginning(exact)), !std::ranges::equal(some, beginning(mine), {}, &Hit::prim, &Hit::prim)};
    }
    return errors;
  });
}

QueryErrors QueryJudge::nearest(std::span<const ProbePoint> points, std::span<const Nearest> found) const {
  const ExactClosestPoints oracle(tree_);
  return sum_over(points.size(), [&](std::size_t begin, std::size_t end) {
    QueryErrors errors;
    for (std::size_t i = begin; i < end; ++i) {
      const ExactClosest exact = oracle.nearest(points[i].at, points[i].limit);
      bool beyond = exact.prim == NO_HIT && found[i].prim != NO_HIT;
      if (exact.prim != NO_HIT) {
        const double reach = found[i].prim == NO_HIT ? 0 : reach_of(points[i].at, triangles_[found[i].prim]);
        const double bound = 64 * kRoundoff * (reach + reach_of(points[i].at, triangles_[exact.prim]));
        beyond = std::abs(double(found[i].distance) - exact.distance) > bound;
      }
      errors += {1, found[i].prim != exact.prim, beyond};
    }
    return errors;
  });
}

QueryErrors QueryJudge::inside(std::span<const ProbePoint> points, std::span<const std::uint32_t> found) const {
  const ExactCrossings oracle(tree_);
  const ExactClosestPoints distances(tree_);
  return sum_over(points.size(), [&](std::size_t begin, std::size_t end) {
    QueryErrors errors;
    for (std::size_t i = begin; i < end; ++i) {
      const bool right = (found[i] != 0) == oracle.inside(points[i].at);
      bool beyond = false;
      if (!right) {
        const ExactClosest near = distances.nearest(points[i].at, INFINITY);
        beyond = near.distance > 16 * kRoundoff * reach_of(points[i].at, triangles_[near.prim]);
      }
      errors += {1, !right, beyond};
    }
    return errors;
  });
}

}  // namespace ballot
