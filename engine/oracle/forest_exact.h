// The exact oracle of a forest, and the errors of answers about it.
#pragma once

#include <deque>

#include "engine/oracle/errors.h"
#include "engine/oracle/forest_oracle.h"

namespace ballot {

/// The exact oracle of a forest: the exact hit of each instance's object-space ray (engine/bvh/instance.h), and among
/// instances that of the smallest t; at equal t of the first instance. Thread-safe. The forest must outlive it and keep
/// its transforms.
class ForestExact {
 public:
  explicit ForestExact(const Forest& forest);

  /// Return the nearest hit; t counts multiples of the ray's direction, and prim is counted through the instances.
  ExactHit nearest(const Ray& ray) const;
  std::vector<ExactHit> nearest(std::span<const Ray> rays, const Progress& progress = {}) const;  // in parallel

  /// Returns the ray's hit of this triangle within [t_min, t_max], or a miss.
  ExactHit hit(const Ray& ray, std::uint32_t prim) const;

  /// Compares the exact t of two triangles of one instance, which the ray hits.
  std::strong_ordering compare_t(const Ray& ray, const Forest::Place& a, const Forest::Place& b) const;

  const Forest& forest() const { return forest_; }
  ExactCounts counts() const;  // of all calls of nearest() so far

 private:
  const Forest& forest_;
  std::vector<PairTree> trees_;      // of the meshes
  std::deque<ExactOracle> oracles_;  // of the meshes; they do not move
};

/// Compares answers with the truth, in parallel, as error_figures() (errors.h) does for a single tree. Of
/// Arithmetic::Exact an answer is also a tie if it names another instance's hit at a t that is the same to two ulps:
/// each instance reports its t to one.
ErrorFigures forest_error_figures(const ForestExact& exact, const ForestOracle& bound, std::span<const Ray> rays,
                                  std::span<const Hit> answers, std::span<const ExactHit> truth, Want want,
                                  Arithmetic arithmetic, std::size_t max_cases);

}  // namespace ballot
