// Counts the errors of a set of float32 answers against the exact oracle.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/oracle/exact.h"
#include "engine/oracle/oracle.h"

namespace ballot {

/// The kinds of wrong answers; ErrorFigures defines them.
enum class ErrorKind { FalseMiss, FalseHit, WrongPrim, WrongValue };

/// Returns "false miss", "false hit", "wrong prim" or "wrong value".
std::string_view name_of(ErrorKind kind);

/// A wrong answer with its ray and the truth.
struct ErrorCase {
  std::size_t index = 0;  // of the ray
  Ray ray{};
  Hit answer{};
  ExactHit truth;
  ErrorKind kind = ErrorKind::FalseMiss;
  bool within_bound = false;  // the error bound of the mode's arithmetic allows for it
  std::string reason;         // "the ray passes 3.1e-09 outside edge 1-2 of prim 77, 0.12 of what float32 may move it"
};

/// Returns one line with ray, answer, truth and reason.
std::string in_words(const ErrorCase& error);

/// Counts of rays by kind of answer. An answer is right, a tie, or exactly one of false miss, false hit, wrong prim,
/// wrong value and beyond range.
///
/// For Want::Nearest the exact oracle's prim is the right one. For Want::Any every prim that the ray hits exactly is
/// right.
struct ErrorFigures {
  std::uint64_t rays = 0;
  std::uint64_t false_misses = 0;  // a miss where some triangle is hit
  std::uint64_t false_hits = 0;    // a hit where none is
  std::uint64_t wrong_prims = 0;   // a hit of a triangle that is not hit, or that is not the nearest
  /// Want::Nearest: answers that name another triangle at exactly the same t, one that does not have the smallest prim.
  /// They are right otherwise.
  std::uint64_t ties = 0;
  /// The prim is right or a tie, but t, u or v is NaN or beyond the mode's error bound, or t is outside of
  /// [t_min, t_max].
  std::uint64_t wrong_values = 0;
  /// False misses, false hits and wrong prims that the error bound of the mode's arithmetic covers: Oracle::judge calls
  /// them Tie or Same. There are none in Arithmetic::Exact.
  std::uint64_t within_bound = 0;
  std::uint64_t beyond_bound = 0;  // the other false misses, false hits and wrong prims
  /// Rays beyond the range of the mode (is_beyond_range): those whose direction is too small to be traced, and those
  /// from too far away whose answer is wrong, which then counts as nothing else.
  std::uint64_t beyond_range = 0;
  std::uint64_t unwritten = 0;  // records that a trace did not write; filled in by the code that traced
  std::uint64_t self_hits = 0;  // answers that name the triangle that the ray starts from; filled in by the caller
  /// Error of t, |t - exact t| in ulps of float32 at max(|exact t|, FLT_MIN). It is taken over the answers with a
  /// finite t whose prim is right or a tie. Ranks are not interpolated. All are 0 if there are no such answers.
  struct {
    double median = 0, p99 = 0, max = 0;
  } t_ulp;
  std::vector<ErrorCase> cases;  // the first wrong answers by index of the ray, at most max_cases

  std::uint64_t errors() const { return false_misses + false_hits + wrong_prims + wrong_values; }
};

/// Compares answers with the truth, in parallel. `truth` holds what ExactOracle::nearest() returned for these rays,
/// whatever `want` is. `bound` is an oracle of the same scene as `exact`. Throws Error(Arguments) if the sizes
/// differ.
ErrorFigures error_figures(const ExactOracle& exact, const Oracle& bound, std::span<const Ray> rays,
                           std::span<const Hit> answers, std::span<const ExactHit> truth, Want want,
                           Arithmetic arithmetic, std::size_t max_cases);

}  // namespace ballot
