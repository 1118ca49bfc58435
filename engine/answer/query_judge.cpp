#include "engine/answer/query_judge.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <mutex>

#include "engine/core/error.h"
#include "engine/core/parallel.h"
#include "engine/oracle/closest.h"
#include "engine/oracle/crossings.h"
#include "engine/oracle/exact.h"
#include "engine/oracle/nearest.h"
#include "engine/tree/host/pseudonormals.h"

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
bool within_bounds(const Ray& ray, const OracleScene& scene, std::span<const Hit> found,
                   const std::vector<ExactCrossing>& exact) {
  const auto is_open = [&](std::uint32_t prim) {
    const PlacedMesh mesh = scene.mesh_of(ray, prim);
    const Ray moved = rounded(mesh.ray);  // which is float32
    return Seen(moved, mesh.triangles[prim - mesh.first]).open(moved);
  };
  const auto room_of_t = [&](std::uint32_t prim) {
    const PlacedMesh mesh = scene.mesh_of(ray, prim);
    return Seen(rounded(mesh.ray), mesh.triangles[prim - mesh.first]).t_off * mesh.scale;
  };
  std::vector<std::pair<std::uint32_t, double>> a, b;
  for (const Hit& h : found) a.emplace_back(h.prim, h.t);
  for (const ExactCrossing& c : exact) b.emplace_back(c.prim, c.t);
  std::ranges::sort(a), std::ranges::sort(b);
  std::size_t i = 0, k = 0;
  while (i < a.size() || k < b.size()) {
    if (i < a.size() && k < b.size() && a[i].first == b[k].first) {
      if (!(std::abs(a[i].second - b[k].second) <= room_of_t(a[i].first))) return false;
      ++i, ++k;
      continue;
    }
    const bool ours = k == b.size() || (i < a.size() && a[i].first < b[k].first);
    if (!is_open(ours ? a[i++].first : b[k++].first)) return false;
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

/// The triangles of a scene in the world.
class WorldTriangles {
 public:
  explicit WorldTriangles(const OracleScene& scene) : scene_(scene) {}

  Triangle operator[](std::uint32_t prim) const { return scene_.world_triangle(prim); }

  /// The bound of the distances from a point of two triangles: 64 * 2^-24 (M + M') + 2^-85 R, with R the largest
  /// distance along an axis from the point to one of the bounds.
  double bound_of(const glm::vec3& p, const Triangle& a, const Triangle& b) const {
    const Bounds& bounds = scene_.bounds();
    const glm::dvec3 at(p), far = glm::max(at - glm::dvec3(bounds.lo), glm::dvec3(bounds.hi) - at);
    return 64 * kRoundoff * (reach_of(p, a) + reach_of(p, b)) + 0x1p-85 * std::max({far.x, far.y, far.z});
  }

 private:
  const OracleScene& scene_;
};

/// Returns true if the answer is within its bounds. `nearest` is the nearest triangle at any distance.
bool is_within(const ProbePoint& asked, const Nearest& found, const ExactClosest& nearest,
               const WorldTriangles& world) {
  if (nearest.prim == NO_HIT) return found.prim == NO_HIT;
  const Triangle truth = world[nearest.prim];
  if (found.prim == NO_HIT) return !(nearest.distance + world.bound_of(asked.at, truth, truth) <= asked.limit);
  const Triangle named = world[found.prim];
  const double bound = world.bound_of(asked.at, truth, named);
  const double own = found.prim == nearest.prim ? nearest.distance : exact_distance(asked.at, named).distance();
  return found.distance <= asked.limit && own <= nearest.distance + bound &&
         std::abs(double(found.distance) - nearest.distance) <= bound;
}

/// Returns true if a point is farther from the inside of a triangle, and its nearest point farther from the edges, than
/// rounding can decide.
bool is_clear(const glm::vec3& point, const WorldTriangles& world, const ExactClosest& nearest) {
  const Triangle triangle = world[nearest.prim];
  const double bound = world.bound_of(point, triangle, triangle);
  for (std::size_t i = 0; i < 3; ++i) {
    const glm::dvec3 a(triangle[i]), edge = glm::dvec3(triangle[(i + 1) % 3]) - a;
    if (glm::length(glm::cross(edge, nearest.at - a)) <= bound * glm::length(edge)) return false;
  }
  return nearest.distance > bound;
}

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

QueryJudge::QueryJudge(DeviceTree& tree) : scene_(tree.oracle_scene()) {
  const ExactOracle oracle(scene_);
  for (std::size_t mesh = 0; mesh < scene_.trees().size(); ++mesh) {
    if (oracle.lost(mesh).empty()) continue;
    fail(Failure::Work,
         "the tree{} lacks triangle {}, which has an area; its builder is wrong: choose another by --build",
         scene_.forest() ? fmt::format(" of mesh {}", mesh) : "", oracle.lost(mesh).front());
  }
}

RayErrors QueryJudge::rays(std::span<const Ray> rays, const RayAnswers& found) const {
  const Starts lists(found.lists), first(found.first);
  const ExactCrossings oracle(scene_);
  return sum_over(rays.size(), [&](std::size_t begin, std::size_t end) {
    RayErrors errors;
    for (std::size_t i = begin; i < end; ++i) {
      const std::span<const Hit> mine = lists.of(i);
      const std::vector<ExactCrossing> exact = oracle.list(rays[i]);
      errors.lists += {1, !is_same(mine, exact), !within_bounds(rays[i], scene_, mine, exact)};
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
  const ExactClosestPoints oracle(scene_);
  const WorldTriangles world(scene_);
  return sum_over(points.size(), [&](std::size_t begin, std::size_t end) {
    QueryErrors errors;
    for (std::size_t i = begin; i < end; ++i) {
      const ProbePoint& asked = points[i];
      const ExactClosest exact = oracle.nearest(asked.at, asked.limit);
      const bool limited = exact.prim == NO_HIT && asked.limit >= 0;
      const ExactClosest nearest = limited ? oracle.nearest(asked.at, INFINITY) : exact;
      errors += {1, found[i].prim != exact.prim, !is_within(asked, found[i], nearest, world)};
    }
    return errors;
  });
}

QueryErrors QueryJudge::sides(std::span<const ProbePoint> points, std::span<const Nearest> found) const {
  const ExactClosestPoints oracle(scene_);
  const WorldTriangles world(scene_);
  const Forest* forest = scene_.forest();
  const std::vector<glm::vec3> pseudonormals =
      forest ? pseudonormals_of(moved_triangles(*forest)) : pseudonormals_of(scene_.triangles(0));
  return sum_over(points.size(), [&](std::size_t begin, std::size_t end) {
    QueryErrors errors;
    for (std::size_t i = begin; i < end; ++i) {
      const ExactClosest exact = oracle.nearest(points[i].at, points[i].limit);
      if (exact.prim == NO_HIT) {
        errors += {1, found[i].behind != 0, found[i].behind != 0 && found[i].prim == NO_HIT};
        continue;
      }
      const Triangle triangle = world[exact.prim];
      const std::uint32_t part = exact_part(points[i].at, triangle);
      const auto vectors = std::span(pseudonormals).subspan(PSEUDONORMALS * std::size_t(exact.prim));
      const bool behind = exact_behind(points[i].at, triangle, part, vectors.first<PSEUDONORMALS>());
      const bool wrong = (found[i].behind != 0) != behind;
      const bool sure = found[i].prim == exact.prim && part == PART_INSIDE && is_clear(points[i].at, world, exact);
      errors += {1, wrong, wrong && sure};
    }
    return errors;
  });
}

QueryErrors QueryJudge::inside(std::span<const ProbePoint> points, std::span<const std::uint32_t> found) const {
  const ExactCrossings oracle(scene_);
  std::vector<ExactClosestPoints> meshes;
  for (const PairTree* tree : scene_.trees()) meshes.emplace_back(*tree);
  // Returns true if the point is so near to the surface of an instance that the bound leaves its side open.
  const auto is_open = [&](const glm::vec3& point) {
    bool open = false;
    scene_.for_each_around(point, [&](std::size_t mesh, const glm::vec3& at) {
      const ExactClosest near = meshes[mesh].nearest(at, INFINITY);
      open = open ||
             (near.prim != NO_HIT && near.distance <= 16 * kRoundoff * reach_of(at, scene_.triangles(mesh)[near.prim]));
    });
    return open;
  };
  return sum_over(points.size(), [&](std::size_t begin, std::size_t end) {
    QueryErrors errors;
    for (std::size_t i = begin; i < end; ++i) {
      const bool right = (found[i] != 0) == oracle.inside(points[i].at);
      errors += {1, !right, !right && !is_open(points[i].at)};
    }
    return errors;
  });
}

}  // namespace ballot
