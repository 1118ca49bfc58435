// The oracles of a forest: what a ray hits among instances, by the definition of object-space rays
// (engine/bvh/instance.h).
#pragma once

#include <deque>
#include <span>
#include <type_traits>
#include <vector>

#include "engine/bvh/forest.h"
#include "engine/oracle/errors.h"

namespace ballot {

/// An oracle for each mesh of a forest, which must outlive this and keep its transforms.
template <class MeshOracle>
class MeshOracles {
 public:
  explicit MeshOracles(const Forest& forest) : forest_(forest) {
    for (const MeshTree& mesh : forest.meshes()) {
      const PairTree& tree = trees_.emplace_back(encode_pairs(mesh.bvh, mesh.triangles, NodeLayout::Interleaved));
      if constexpr (std::is_same_v<MeshOracle, ExactOracle>)
        oracles_.emplace_back(tree, mesh.triangles);
      else
        oracles_.emplace_back(tree);
    }
  }

  const Forest& forest() const { return forest_; }
  const Bounds& bounds() const { return forest_.top_facts().bounds; }

 protected:
  const Instance& instance(std::uint32_t number) const { return forest_.instances()[number]; }
  const MeshOracle& oracle(const Instance& i) const { return oracles_[i.mesh]; }
  const std::deque<MeshOracle>& oracles() const { return oracles_; }

 private:
  const Forest& forest_;
  std::deque<PairTree> trees_;  // neither trees nor oracles move
  std::deque<MeshOracle> oracles_;
};

/// The double precision oracle of a forest, and its judge. Thread-safe.
class ForestOracle : public MeshOracles<Oracle> {
 public:
  using MeshOracles::MeshOracles;

  /// Returns the nearest hit in double precision; t counts multiples of the ray's direction, and prim is counted
  /// through the instances. Each instance's own ray is that of float32.
  OracleHit nearest(const Ray& ray) const;
  std::vector<OracleHit> nearest(std::span<const Ray> rays) const;  // in parallel

  /// Judges an answer. An answer that names an instance is right if it is right for that instance alone, and if no
  /// other one has a hit that is nearer by more than the answer's own rounding error. A miss is right if it is for
  /// every instance.
  Verdict judge(const Ray& ray, const Hit& answer, Want want, Arithmetic arithmetic = Arithmetic::Woop) const;
  /// The same; the nearest hit is not needed.
  Verdict judge(const Ray& ray, const Hit& answer, const OracleHit&, Want want, Arithmetic arithmetic) const {
    return judge(ray, answer, want, arithmetic);
  }
  /// Judges t, u and v of an answer alone. `own` is the hit of the triangle that it names.
  Verdict judge_values(const Ray& ray, const Hit& answer, const OracleHit& own, Want want, Arithmetic arithmetic) const;
  /// The same as judge() for many rays, in parallel. Throws Error(Arguments) if the sizes differ.
  Judgement judge(std::span<const Ray> rays, std::span<const Hit> answers, Want want,
                  Arithmetic arithmetic = Arithmetic::Woop) const;
};

/// The exact oracle of a forest: the exact hit of each instance's object-space ray, and among instances that of the
/// smallest t; at equal t of the first instance. Thread-safe.
class ForestExact : public MeshOracles<ExactOracle> {
 public:
  using MeshOracles::MeshOracles;

  /// Return the nearest hit; t counts multiples of the ray's direction, and prim is counted through the instances.
  ExactHit nearest(const Ray& ray) const;
  std::vector<ExactHit> nearest(std::span<const Ray> rays, const Progress& progress = {}) const;  // in parallel

  /// Returns the ray's hit of this triangle within [t_min, t_max], or a miss, as for a number beyond the last.
  ExactHit hit(const Ray& ray, std::uint32_t prim) const;

  /// Returns true if two hits of the ray are at the same t: exactly, if they are of one instance. Each instance reports
  /// its t to one ulp, so of Arithmetic::Exact two ulps are granted between hits of two instances.
  bool ties(const Ray& ray, const ExactHit& a, const ExactHit& b, Arithmetic arithmetic) const;

  ExactCounts counts() const;  // of all calls of nearest() so far
};

/// Compares answers with the truth, in parallel, as error_figures() does for a single tree.
ErrorFigures error_figures(const ForestExact& exact, const ForestOracle& bound, std::span<const Ray> rays,
                           std::span<const Hit> answers, std::span<const ExactHit> truth, Want want,
                           Arithmetic arithmetic, std::size_t max_cases);

}  // namespace ballot
