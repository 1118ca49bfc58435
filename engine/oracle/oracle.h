// The CPU's answer: plain recursion in double precision over the very arrays that are uploaded, and a judge that says
// whether a float32 answer is right. Used by tests and tools, never by the tracer.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "engine/formats/pair.h"

namespace ballot {

enum class Want : std::uint32_t { Nearest = 0, Any = 1 };

struct OracleHit {
  double t = 0;
  std::uint32_t prim = NO_HIT;
  double u = 0, v = 0;
};

/// How a float32 answer stands against the double precision one. Float32 cannot decide rays that pass an edge closer
/// than its rounding, nor order hits closer than its rounding; such answers are Tie only if the judge shows, from the
/// bound of the arithmetic's rounding error (oracle_judge.cpp), that both answers lie within it. Everything else is an
/// error. WrongT: t, u or v of the triangle lies beyond its bound, or is NaN.
enum class Verdict { Same, Tie, FalseMiss, FalseHit, WrongPrim, WrongT };

struct Judgement {
  std::uint64_t rays = 0, same = 0, tie = 0, false_miss = 0, false_hit = 0, wrong_prim = 0, wrong_t = 0;
  double worst_t_error = 0;           // of Same answers: |t - t_oracle| over its bound; at most 1
  std::vector<std::string> examples;  // the first few errors, in words, with ray and both answers
  std::uint64_t errors() const { return false_miss + false_hit + wrong_prim + wrong_t; }
};

/// Whose rounding the judge allows for: the bound of the triangle test that made the answers. Exact: decisions without
/// rounding, so nothing is a tie; t within one ulp of float32 of the exact t, u and v within 2^-22.
enum class Arithmetic { Woop, MoellerTrumbore, WoopAffine, Exact };

/// What float32 may make of a ray and a triangle.
struct Allowance {
  double edge[3];  // |edge function| opposite to each vertex over the bound of its error: above 1 its sign is certain
  double t;        // bound of t's error
};

class Oracle {
 public:
  explicit Oracle(const PairTree& bvh);  // keeps a reference: bvh must outlive the oracle

  /// Nearest hit: the smallest t in [t_min, t_max], among equal t the smallest prim. Dead rays miss.
  OracleHit nearest(const Ray& ray) const;
  std::vector<OracleHit> nearest(std::span<const Ray> rays) const;  // parallel

  /// Tests every triangle of the leaf array, without the tree. For small scenes.
  OracleHit brute_force(const Ray& ray) const;

  /// `truth` is what nearest() gave for this ray, for both wants.
  Verdict judge(const Ray& ray, const Hit& answer, const OracleHit& truth, Want want,
                Arithmetic arithmetic = Arithmetic::Woop) const;
  Judgement judge(std::span<const Ray> rays, std::span<const Hit> answers, std::span<const OracleHit> truth, Want want,
                  Arithmetic arithmetic = Arithmetic::Woop) const;  // parallel

  /// Of a ray that is not dead and the triangle of this number. Zero error of Arithmetic::Exact gives infinite edges.
  Allowance allowance(const Ray& ray, std::uint32_t prim, Arithmetic arithmetic) const;

 private:
  const PairTree& bvh_;
  std::vector<std::uint32_t> texel_of_;  // of each prim's triangle in the leaf array; NO_HIT if no leaf holds it
};

/// Ray is dead by definition (layout.h): t_max <= t_min, NaN or infinite component, direction zero or denormal.
bool is_dead(const Ray& ray);

}  // namespace ballot
