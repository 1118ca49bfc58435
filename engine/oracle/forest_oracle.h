// The oracle of a forest: what a ray hits among instances, by the definition of object-space rays
// (engine/bvh/instance.h).
#pragma once

#include <span>
#include <vector>

#include "engine/bvh/forest.h"
#include "engine/oracle/oracle.h"

namespace ballot {

/// The double precision oracle of a forest, and its judge. Thread-safe. The forest must outlive it and keep its
/// transforms.
class ForestOracle {
 public:
  explicit ForestOracle(const Forest& forest);

  /// Returns the nearest hit in double precision; t counts multiples of the ray's direction, and prim is counted
  /// through the instances. Each instance's own ray is that of float32.
  OracleHit nearest(const Ray& ray) const;
  std::vector<OracleHit> nearest(std::span<const Ray> rays) const;  // in parallel

  /// Judges an answer. An answer that names an instance is right if it is right for that instance alone, and if no
  /// other one has a hit that is nearer by more than the answer's own rounding error. A miss is right if it is for
  /// every instance.
  Verdict judge(const Ray& ray, const Hit& answer, Want want, Arithmetic arithmetic = Arithmetic::Woop) const;
  /// Judges t, u and v of an answer alone. `own` is the hit of the triangle that it names.
  Verdict judge_values(const Ray& ray, const Hit& answer, const OracleHit& own, Arithmetic arithmetic) const;
  /// The same as judge() for many rays, in parallel. Throws Error(Arguments) if the sizes differ.
  Judgement judge(std::span<const Ray> rays, std::span<const Hit> answers, Want want,
                  Arithmetic arithmetic = Arithmetic::Woop) const;

 private:
  const Forest& forest_;
  std::vector<PairTree> trees_;  // of the meshes
  std::vector<Oracle> oracles_;
};

}  // namespace ballot
