// The exact oracle: what a ray hits, decided without rounding for float32 input, over the arrays that are uploaded.
//
// The definition: vertices, origin, direction, t_min and t_max are the real numbers that their float32 values are; the
// ray is o + t d. It hits a triangle if the exact point lies in the closed triangle and t_min <= t <= t_max exactly.
// Triangles are two-sided. A ray in a triangle's plane misses it; a degenerate triangle is never hit; a dead ray
// (is_dead) misses. Nearest is the smallest exact t, among exactly equal t the smallest prim.
//
// Method: candidates from a conservative traversal (walk.h); a floating-point filter with a proved bound decides most
// of them (filter.h), integers of up to 2048 bits the others (predicates.h, dyadic.h). Filter, then exact arithmetic:
// Shewchuk. Adaptive precision floating-point arithmetic and fast robust geometric predicates. Discrete &
// Computational Geometry 18, 1997, section 1.
#pragma once

#include <array>
#include <atomic>
#include <compare>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "engine/formats/pair.h"

namespace ballot {

/// t counts multiples of the direction; u and v weigh vertices 1 and 2. Each is a quotient of exact numbers, rounded to
/// the nearest double or its neighbour: off by less than 0.502 ulp (Dyadic's quotient). Zero on a miss.
struct ExactHit {
  double t = 0;
  std::uint32_t prim = NO_HIT;
  double u = 0, v = 0;
};

/// Of nearest(): work, and how often the filter could not decide.
struct ExactCounts {
  std::uint64_t rays = 0;
  std::uint64_t triangle_tests = 0;     // a triangle in several leaves counts in each
  std::uint64_t side_failures = 0;      // whether the line meets the triangle
  std::uint64_t interval_failures = 0;  // whether t lies in [t_min, t_max]
  std::uint64_t order_failures = 0;     // which of two triangles is nearer
  std::uint64_t failures() const { return side_failures + interval_failures + order_failures; }
  ExactCounts& operator+=(const ExactCounts& other);
};
ExactCounts operator-(const ExactCounts& a, const ExactCounts& b);

/// All calls may be made from several threads at once. Prims that no leaf holds are never hit: triangles whose cross
/// product of edges is zero in double precision (engine/bvh/build.h, is_degenerate).
class ExactOracle {
 public:
  explicit ExactOracle(const PairTree& bvh);  // keeps a reference: bvh must outlive the oracle

  ExactHit nearest(const Ray& ray) const;
  /// The same of each ray, in parallel. progress is called after every chunk, from one thread at a time.
  std::vector<ExactHit> nearest(std::span<const Ray> rays, const Progress& progress = {}) const;

  /// Tests every triangle of the leaf array by exact arithmetic alone: no filter, no tree. For small scenes.
  ExactHit brute_force(const Ray& ray) const;

  /// The ray's hit of this triangle within [t_min, t_max], or a miss.
  ExactHit hit(const Ray& ray, std::uint32_t prim) const;
  bool hits(const Ray& ray, std::uint32_t prim) const { return hit(ray, prim).prim != NO_HIT; }

  /// The order of the exact t at which the ray's line meets the planes of two triangles. Throws Error(Arguments) if a
  /// prim is in no leaf, or the ray is dead or parallel to its plane.
  std::strong_ordering compare_t(const Ray& ray, std::uint32_t prim_a, std::uint32_t prim_b) const;

  /// The triangle of this number, if some leaf holds it.
  std::optional<Triangle> triangle(std::uint32_t prim) const;

  ExactCounts counts() const;  // of all calls of nearest() so far

 private:
  void add(const ExactCounts& counts) const;

  const PairTree& bvh_;
  std::vector<std::uint32_t> texel_of_;  // of each prim's triangle in the leaf array; NO_HIT if no leaf holds it
  mutable std::array<std::atomic<std::uint64_t>, 5> totals_{};
};

}  // namespace ballot
