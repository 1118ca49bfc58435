#include "engine/oracle/error_findings.h"

#include <algorithm>

#include "engine/core/error.h"

namespace ballot {
namespace {

void count(ErrorFigures& sum, const Finding& finding) {
  ++sum.rays;
  sum.ties += finding.tie ? 1 : 0;
  sum.beyond_range += finding.beyond_range ? 1 : 0;
  if (!finding.wrong) return;
  std::uint64_t* const of[] = {&sum.false_misses, &sum.false_hits, &sum.wrong_prims, &sum.wrong_values};
  ++*of[static_cast<int>(*finding.wrong)];  // in the order of ErrorKind
  if (*finding.wrong == ErrorKind::WrongValue) return;
  ++(finding.within_bound ? sum.within_bound : sum.beyond_bound);
}

void sum_up_t(ErrorFigures& sum, std::span<const Finding> findings) {
  std::vector<double> errors;
  errors.reserve(findings.size());
  for (const Finding& f : findings)
    if (f.t_ulp >= 0) errors.push_back(f.t_ulp);
  if (errors.empty()) return;
  const auto rank = [&](double share) {
    const auto at = errors.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(errors.size() - 1));
    std::nth_element(errors.begin(), at, errors.end());
    return *at;
  };
  sum.t_ulp = {rank(0.5), rank(0.99), rank(1)};
}

}  // namespace

void check_sizes(const Answers& of) {
  if (of.rays.size() != of.answers.size() || of.rays.size() != of.truth.size())
    fail(Failure::Arguments, "error figures: {} rays, {} answers and {} truths; their numbers must agree",
         of.rays.size(), of.answers.size(), of.truth.size());
}

ErrorFigures sum_of(std::span<const Finding> findings) {
  ErrorFigures sum;
  for (const Finding& finding : findings) count(sum, finding);
  sum_up_t(sum, findings);
  return sum;
}

void add_cases(ErrorFigures& sum, std::span<const Finding> findings, const Answers& of, std::size_t max_cases,
               const std::function<std::string(const ErrorCase&)>& reason) {
  for (std::size_t i = 0; i < findings.size() && sum.cases.size() < max_cases; ++i) {
    if (!findings[i].wrong) continue;
    sum.cases.push_back({i, of.rays[i], of.answers[i], of.truth[i], *findings[i].wrong, findings[i].within_bound, {}});
    sum.cases.back().reason = reason(sum.cases.back());
  }
}

}  // namespace ballot
