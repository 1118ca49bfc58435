// What judges find on single answers, and how that adds up to error figures. Internal to engine/oracle.
#pragma once

#include <functional>
#include <optional>
#include <span>

#include "engine/core/parallel.h"
#include "engine/oracle/errors.h"

namespace ballot {

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

}  // namespace ballot
