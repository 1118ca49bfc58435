// The oracle: finds hits on the CPU in double precision, by a plain traversal of the same arrays that are uploaded to
// the device. It also judges whether a float32 answer is right. Tests and tools use it; the tracer never does.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "engine/core/want.h"
#include "engine/oracle/oracle_scene.h"

namespace ballot {

/// The verdict on a float32 answer, compared with the double precision one. Float32 can neither decide rays that pass
/// an edge closer than its rounding error nor order hits that are closer than that. Such an answer is a Tie only if the
/// judge shows, from the bound of the rounding error (judge.cpp), that both answers lie within the bound. Everything
/// else is an error. WrongT: t, u or v of the triangle lies beyond its bound or is NaN.
enum class Verdict { Same, Tie, FalseMiss, FalseHit, WrongPrim, WrongT };

/// Counts of verdicts over a set of rays.
struct Judgement {
  std::uint64_t rays = 0, same = 0, tie = 0, false_miss = 0, false_hit = 0, wrong_prim = 0, wrong_t = 0;
  double worst_t_error = 0;           // largest |t - t_oracle| of Same answers as a share of its bound; at most 1
  std::vector<std::string> examples;  // the first few errors, in words, with the ray and both answers
  std::uint64_t errors() const { return false_miss + false_hit + wrong_prim + wrong_t; }
  /// Counts the verdict on one more ray.
  void add(Verdict verdict);
};

/// The rounding error that the judge allows for a ray and a triangle.
struct Allowance {
  double edge[3];  // |edge function| opposite to each vertex over its error bound; above 1 its sign is certain
  double t;        // error bound of t
};

/// The double precision oracle of a scene. Thread-safe.
class Oracle {
 public:
  explicit Oracle(OracleScene scene) : scene_(std::move(scene)), moved_in_double_(scene_.in_double()) {}

  /// Returns the nearest hit: the smallest t in [t_min, t_max], and among equal t the smallest prim. Dead rays miss.
  /// The rays of instances are those of float32.
  OracleHit nearest(const Ray& ray) const;
  std::vector<OracleHit> nearest(std::span<const Ray> rays) const;  // in parallel

  /// Returns the nearest hit by testing every triangle of the leaf array, without the tree. For small scenes.
  OracleHit brute_force(const Ray& ray) const;

  /// Judges an answer. `truth` is what nearest() returned for this ray, whatever `want` is. Judging many rays is
  /// parallel and throws Error(Arguments) if the sizes differ.
  /// Among instances an answer that names one is right if it is right for that instance alone, and if no other one has
  /// a hit that is nearer by more than the answer's own rounding error. A miss is right if it is for every instance.
  /// Their rays are those of OracleScene::in_double() for WoopInDouble.
  Verdict judge(const Ray& ray, const Hit& answer, const OracleHit& truth, Want want,
                Arithmetic arithmetic = Arithmetic::Woop) const;
  Judgement judge(std::span<const Ray> rays, std::span<const Hit> answers, std::span<const OracleHit> truth, Want want,
                  Arithmetic arithmetic = Arithmetic::Woop) const;

  /// Judges t, u and v of an answer alone. `own` is the hit of the triangle that it names.
  Verdict judge_values(const Ray& ray, const Hit& answer, const OracleHit& own, Want want, Arithmetic arithmetic) const;

  /// Returns the allowance for a ray that is not dead and the triangle of this number. Arithmetic::Exact has no error,
  /// so its edges are infinite. Throws Error(Arguments) if no leaf holds the prim.
  Allowance allowance(const Ray& ray, std::uint32_t prim, Arithmetic arithmetic) const;

  const OracleScene& scene() const { return scene_; }

 private:
  const OracleScene& scene_for(Arithmetic arithmetic) const {
    return arithmetic == Arithmetic::WoopInDouble ? moved_in_double_ : scene_;
  }

  OracleScene scene_, moved_in_double_;
};

/// The farthest from a scene that a ray may start, in diagonals of the scene's bounds, for the promises of the numeric
/// modes but `exact` and `double`. Their arithmetic moves a vertex by up to about 2^-22 of its distance from the ray's
/// origin; from 2^20 diagonals away that is a quarter of the scene.
inline constexpr double kRangeDiagonals = 1 << 20;

/// True if the numbers of a ray are beyond what its mode promises to answer: its direction is not zero, but so small
/// that the ray is dead (every component below 2^-126), or, unless the arithmetic is Exact, it starts farther from
/// `bounds` than kRangeDiagonals. False for other dead rays, which all modes answer by a miss.
bool is_beyond_range(const Ray& ray, const Bounds& bounds, Arithmetic arithmetic);

/// True if the ray is dead (shaders/shared/layout.h): t_max <= t_min, a component is NaN or infinite, or the direction
/// is zero or denormal.
bool is_dead(const Ray& ray);
/// The same in double: float32 cannot hold a number, the direction is zero or denormal there, or t_max <= t_min.
bool is_dead(const RayInDouble& ray);

}  // namespace ballot
