// The errors of a set of float32 answers, held to the exact oracle.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/oracle/exact.h"
#include "engine/oracle/oracle.h"

namespace ballot {

enum class ErrorKind { FalseMiss, FalseHit, WrongPrim, WrongValue };

/// "false miss", "false hit", "wrong prim", "wrong value".
std::string_view name_of(ErrorKind kind);

struct ErrorCase {
  std::size_t index = 0;  // of the ray
  Ray ray{};
  Hit answer{};
  ExactHit truth;
  ErrorKind kind = ErrorKind::FalseMiss;
  bool within_bound = false;  // the bound of the mode's arithmetic explains it
  std::string reason;         // "the ray passes 3.1e-09 outside edge 1-2 of prim 77, 0.12 of what float32 may move it"
};

/// A line with ray, answer, truth and reason.
std::string in_words(const ErrorCase& error);

/// Counts of rays. An answer is right, a tie, or exactly one of false miss, false hit, wrong prim and wrong value.
///
/// Nearest: the right prim is the exact oracle's. Any: every prim that the ray hits exactly is right.
struct ErrorFigures {
  std::uint64_t rays = 0;
  std::uint64_t false_misses = 0;  // a miss where some triangle is hit
  std::uint64_t false_hits = 0;    // a hit where none is
  std::uint64_t wrong_prims = 0;   // a hit of a triangle that is not hit, or that is not the nearest
  std::uint64_t ties =
      0;  // nearest: another triangle at exactly the same t, but not the smallest prim; right otherwise
  std::uint64_t wrong_values =
      0;  // right prim or tie, but t, u or v is NaN or beyond the mode's bound, or t is outside
          // of [t_min, t_max]
  std::uint64_t within_bound = 0;  // of false misses, false hits and wrong prims: Oracle::judge calls them Tie or Same,
                                   // as the bound of the mode's arithmetic covers them. None in Arithmetic::Exact
  std::uint64_t beyond_bound = 0;  // the others of these
  std::uint64_t unwritten = 0;     // records that a trace left as they were; filled by who traced
  std::uint64_t self_hits = 0;     // answers that name the triangle which the ray starts from; filled by who knows it
  struct {
    double median = 0, p99 = 0, max = 0;
  } t_ulp;  // |t - exact t| in ulps of float32 at max(|exact t|, FLT_MIN), over answers of the right prim and ties with
            // a finite t; ranks without interpolation; 0 if there are none
  std::vector<ErrorCase> cases;  // the first wrong answers by index, at most max_cases

  std::uint64_t errors() const { return false_misses + false_hits + wrong_prims + wrong_values; }
};

/// Holds answers to the truth, in parallel. `truth` is what ExactOracle::nearest() gave for these rays, for both wants;
/// `bound` is over the same hierarchy as the exact oracle. Throws Error(Arguments) if the sizes differ.
ErrorFigures error_figures(const ExactOracle& exact, const Oracle& bound, std::span<const Ray> rays,
                           std::span<const Hit> answers, std::span<const ExactHit> truth, Want want,
                           Arithmetic arithmetic, std::size_t max_cases);

}  // namespace ballot
