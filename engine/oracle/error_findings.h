// What judges find on single answers, and how that adds up to error figures. Internal to engine/oracle.
#pragma once

#include <cmath>
#include <functional>
#include <optional>
#include <span>

#include "engine/core/parallel.h"
#include "engine/oracle/errors.h"

namespace ballot {

/// Returns a difference of t in ulps of float32 at max(|t|, FLT_MIN).
double in_ulps(double difference, double t);

/// A judge's finding on one answer.
struct Finding {
  std::optional<ErrorKind> wrong = {};
  bool tie = false, within_bound = false, beyond_range = false;
  double t_ulp = -1;  // error of t in ulps; negative: none
};

/// Answers and the truth about their rays.
struct Answers {
  std::span<const Ray> rays;
  std::span<const Hit> answers;
  std::span<const ExactHit> truth;
};

/// Throws Error(Arguments) if the numbers of rays, answers and truths differ.
void check_sizes(const Answers& of);

/// Returns the counts and the errors of t.
ErrorFigures sum_of(std::span<const Finding> findings);

/// Describes the first errors, at most max_cases.
void add_cases(ErrorFigures& sum, std::span<const Finding> findings, const Answers& of, std::size_t max_cases,
               const std::function<std::string(const ErrorCase&)>& reason);

/// Has a judge find() the findings of all answers, in parallel, and adds them up. Throws as check_sizes() does.
template <class Judge>
ErrorFigures figures_of(const Judge& judge, const Answers& of, std::size_t max_cases,
                        const std::function<std::string(const ErrorCase&)>& reason) {
  constexpr std::size_t kRaysAtOnce = 256;
  check_sizes(of);
  std::vector<Finding> findings(of.rays.size());
  for_chunks(findings.size(), kRaysAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) findings[i] = judge.find(of.rays[i], of.answers[i], of.truth[i]);
  });
  ErrorFigures sum = sum_of(findings);
  add_cases(sum, findings, of, max_cases, reason);
  return sum;
}

inline OracleHit rounded(const ExactHit& hit) { return {hit.t, hit.prim, hit.u, hit.v}; }

/// Judges answers about one tree or a forest by its two oracles. An exact oracle has hit() and ties(), a bound oracle
/// judge(), judge_values() and bounds().
template <class Exact, class Bound>
class Judge {
 public:
  Judge(const Exact& exact, const Bound& bound, Want want, Arithmetic arithmetic)
      : exact_(exact), bound_(bound), want_(want), arithmetic_(arithmetic) {}

  Finding find(const Ray& ray, const Hit& answer, const ExactHit& truth) const {
    const Finding finding = find_in_range(ray, answer, truth);
    if (finding.wrong.has_value() == is_dead(ray)) return finding;  // right on a live ray, or a hit of a dead one
    return is_beyond_range(ray, bound_.bounds(), arithmetic_) ? Finding{.beyond_range = true} : finding;
  }

 private:
  Finding find_in_range(const Ray& ray, const Hit& answer, const ExactHit& truth) const {
    if (answer.prim == NO_HIT && truth.prim == NO_HIT) return {};
    if (answer.prim == NO_HIT) return wrong(ErrorKind::FalseMiss, ray, answer, truth);
    if (truth.prim == NO_HIT) return wrong(ErrorKind::FalseHit, ray, answer, truth);
    if (answer.prim == truth.prim) return check_values(ray, answer, truth, false);
    const ExactHit own = exact_.hit(ray, answer.prim);
    if (own.prim == NO_HIT) return wrong(ErrorKind::WrongPrim, ray, answer, truth);
    if (want_ == Want::Any) return check_values(ray, answer, own, false);
    if (!exact_.ties(ray, own, truth, arithmetic_)) return wrong(ErrorKind::WrongPrim, ray, answer, truth);
    return check_values(ray, answer, own, true);
  }

  Finding wrong(ErrorKind kind, const Ray& ray, const Hit& answer, const ExactHit& truth) const {
    const Verdict verdict = bound_.judge(ray, answer, rounded(truth), want_, arithmetic_);
    const bool covered = verdict == Verdict::Tie || verdict == Verdict::Same;
    return {.wrong = kind, .within_bound = covered && arithmetic_ != Arithmetic::Exact};
  }

  /// Checks t, u and v of the answer. `own` is the exact hit of the triangle that the answer names.
  Finding check_values(const Ray& ray, const Hit& answer, const ExactHit& own, bool tie) const {
    Finding finding;
    finding.tie = tie;
    const double error = in_ulps(std::abs(answer.t - own.t), own.t);
    if (std::isfinite(error)) finding.t_ulp = error;
    if (bound_.judge_values(ray, answer, rounded(own), want_, arithmetic_) == Verdict::Same) return finding;
    finding.tie = false;
    finding.wrong = ErrorKind::WrongValue;
    return finding;
  }

  const Exact& exact_;
  const Bound& bound_;
  Want want_;
  Arithmetic arithmetic_;
};

}  // namespace ballot
