// The exact oracle: finds what a ray hits. For float32 input it decides without rounding, over the arrays that are
// uploaded to the device.
//
// Definition. The float32 values of vertices, origin, direction, t_min and t_max are taken as real numbers. The ray is
// o + t d. It hits a triangle if the exact point lies in the closed triangle and t_min <= t <= t_max exactly. Triangles
// are two-sided. A ray in the plane of a triangle misses it. A degenerate triangle is never hit. A dead ray (is_dead)
// misses everything. The nearest hit is that of the smallest exact t, and of the smallest prim among exactly equal t.
// Shapes other than triangles: shape_sight.h.
// Instances are hit as their object-space rays, of float32 or of OracleScene::in_double(), hit their meshes; of their
// nearest hits that of the smallest t in double precision counts, at equal t that of the first instance.
//
// Method. A conservative traversal finds candidates (walker.h). A floating-point filter with a proved error bound
// decides most of them (filter.h). Integers decide the others (predicates.h, dyadic.h). The filter
// before exact arithmetic: Shewchuk. Adaptive precision floating-point arithmetic and fast robust geometric predicates.
// Discrete & Computational Geometry 18, 1997, section 1.
#pragma once

#include <array>
#include <atomic>
#include <compare>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/oracle/oracle.h"

namespace ballot {

/// A hit of the exact oracle. t, u and v are each a quotient of exact numbers, rounded to the nearest double or its
/// neighbour, with an error below 0.502 ulp (Dyadic's quotient).
using ExactHit = OracleHit;

/// Counts of the work that nearest() does, and of the decisions that the filter left to exact arithmetic.
struct ExactCounts {
  std::uint64_t rays = 0;
  std::uint64_t triangle_tests = 0;     // a triangle in several leaves counts once for each
  std::uint64_t side_failures = 0;      // the filter could not tell whether the line meets the triangle
  std::uint64_t interval_failures = 0;  // the filter could not tell whether t lies in [t_min, t_max]
  std::uint64_t order_failures = 0;     // the filter could not tell which of two triangles is nearer
  std::uint64_t failures() const { return side_failures + interval_failures + order_failures; }
  ExactCounts& operator+=(const ExactCounts& other);
};
ExactCounts operator-(const ExactCounts& a, const ExactCounts& b);

/// The exact oracle of a scene. Thread-safe. A prim that no leaf holds is never hit, unless it is lost().
class ExactOracle {
 public:
  /// Triangles of the scene that no leaf holds though integers say that they have an area are looked at for every ray,
  /// so that the oracle does not share the faults of a builder.
  explicit ExactOracle(OracleScene scene);
  explicit ExactOracle(const PairTree& bvh, std::span<const Triangle> triangles = {})
      : ExactOracle(OracleScene(bvh, triangles)) {}

  /// Returns the nearest hit of a ray.
  ExactHit nearest(const Ray& ray) const;
  /// Returns the nearest hit of each ray, in parallel. Calls progress after every chunk, from one thread at a time.
  std::vector<ExactHit> nearest(std::span<const Ray> rays, const Progress& progress = {}) const;

  /// Returns the nearest hit by exact tests of every triangle in the leaf array, without filter and tree. For small
  /// scenes of triangles alone.
  ExactHit brute_force(const Ray& ray) const;

  /// Returns the ray's (nearest) hit of this triangle or shape within [t_min, t_max], or a miss.
  ExactHit hit(const Ray& ray, std::uint32_t prim) const;
  bool hits(const Ray& ray, std::uint32_t prim) const { return hit(ray, prim).prim != NO_HIT; }

  /// Compares the exact t at which the ray's line meets the planes of two triangles, of one instance. Throws
  /// Error(Arguments) if a prim is in no leaf, the ray is dead, or the ray is parallel to a plane.
  std::strong_ordering compare_t(const Ray& ray, std::uint32_t prim_a, std::uint32_t prim_b) const;
  /// Returns true if two hits of the ray are at the same t: exactly, if they are of one instance. Each instance reports
  /// its t to one ulp, so of Arithmetic::Exact two ulps are granted between hits of two instances.
  bool ties(const Ray& ray, const ExactHit& a, const ExactHit& b, Arithmetic arithmetic) const;

  /// Returns the triangle of this number, in the space of its mesh, if some leaf holds it.
  std::optional<Triangle> triangle(std::uint32_t prim) const;

  /// Returns the triangles with area of a mesh that no leaf holds: none, unless a builder is wrong.
  std::span<const std::uint32_t> lost(std::size_t mesh = 0) const { return lost_[mesh]; }

  const OracleScene& scene() const { return scene_; }

  ExactCounts counts() const;  // of all calls of nearest() so far

 private:
  void add(const ExactCounts& counts) const;

  OracleScene scene_;
  std::vector<std::vector<std::uint32_t>> lost_;  // of each mesh
  mutable std::array<std::atomic<std::uint64_t>, 5> totals_{};
};

}  // namespace ballot
