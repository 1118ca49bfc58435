// What judges find on single answers, and how that adds up to error figures. Internal to engine/oracle.
#pragma once

#include <functional>
#include <optional>
#include <span>

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

}  // namespace ballot
