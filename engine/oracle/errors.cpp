#include "engine/oracle/errors.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/core/error.h"
#include "engine/core/parallel.h"
#include "engine/oracle/error_reasons.h"

namespace ballot {
namespace {

constexpr std::size_t kRaysPerErrorsChunk = 1024;

// The judge's finding on one answer.
struct Finding {
  std::optional<ErrorKind> wrong = {};
  bool tie = false, within_bound = false, beyond_range = false;
  double t_ulp = -1;  // error of t in ulps; negative: none
};

OracleHit rounded(const ExactHit& hit) { return {hit.t, hit.prim, hit.u, hit.v}; }

class Judge {
 public:
  Judge(const ExactOracle& exact, const Oracle& bound, Want want, Arithmetic arithmetic)
      : exact_(exact), bound_(bound), want_(want), arithmetic_(arithmetic) {}

  Finding find(const Ray& ray, const Hit& answer, const ExactHit& truth) const {
    const Finding finding = find_in_range(ray, answer, truth);
    if (finding.wrong.has_value() == is_dead(ray)) return finding;  // right, or a hit of a ray that is not traced
    return is_beyond_range(ray, bound_.bounds(), arithmetic_) ? Finding{.beyond_range = true} : finding;
  }

 private:
  Finding find_in_range(const Ray& ray, const Hit& answer, const ExactHit& truth) const {
    if (answer.prim == NO_HIT && truth.prim == NO_HIT) return {};
    if (answer.prim == NO_HIT) return wrong(ErrorKind::FalseMiss, ray, answer, truth);
    if (truth.prim == NO_HIT) return wrong(ErrorKind::FalseHit, ray, answer, truth);
    if (answer.prim == truth.prim) return hold_values(ray, answer, truth, false);
    const ExactHit own = exact_.hit(ray, answer.prim);
    if (own.prim == NO_HIT) return wrong(ErrorKind::WrongPrim, ray, answer, truth);
    if (want_ == Want::Any) return hold_values(ray, answer, own, false);
    if (exact_.compare_t(ray, answer.prim, truth.prim) != 0) return wrong(ErrorKind::WrongPrim, ray, answer, truth);
    return hold_values(ray, answer, own, true);
  }

  Finding wrong(ErrorKind kind, const Ray& ray, const Hit& answer, const ExactHit& truth) const {
    const Verdict verdict = bound_.judge(ray, answer, rounded(truth), want_, arithmetic_);
    const bool covered = verdict == Verdict::Tie || verdict == Verdict::Same;
    return {.wrong = kind, .within_bound = covered && arithmetic_ != Arithmetic::Exact};
  }

  // Checks t, u and v of the answer. `own` is the exact hit of the triangle that the answer names.
  Finding hold_values(const Ray& ray, const Hit& answer, const ExactHit& own, bool tie) const {
    Finding finding;
    finding.tie = tie;
    const double error = in_ulps(std::abs(answer.t - own.t), own.t);
    if (std::isfinite(error)) finding.t_ulp = error;
    if (bound_.judge(ray, answer, rounded(own), want_, arithmetic_) == Verdict::Same) return finding;
    finding.tie = false;
    finding.wrong = ErrorKind::WrongValue;
    return finding;
  }

  const ExactOracle& exact_;
  const Oracle& bound_;
  Want want_;
  Arithmetic arithmetic_;
};

void count(ErrorFigures& sum, const Finding& finding) {
  ++sum.rays;
  sum.ties += finding.tie ? 1 : 0;
  sum.beyond_range += finding.beyond_range ? 1 : 0;
  if (!finding.wrong) return;
  switch (*finding.wrong) {
    case ErrorKind::FalseMiss:
      ++sum.false_misses;
      break;
    case ErrorKind::FalseHit:
      ++sum.false_hits;
      break;
    case ErrorKind::WrongPrim:
      ++sum.wrong_prims;
      break;
    case ErrorKind::WrongValue:
      ++sum.wrong_values;
      return;
  }
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

std::string_view name_of(ErrorKind kind) {
  constexpr std::string_view kNames[] = {"false miss", "false hit", "wrong prim", "wrong value"};
  return kNames[static_cast<int>(kind)];
}

std::string in_words(const ErrorCase& e) {
  const auto hit = [](std::uint32_t prim, double t, double u, double v) {
    return prim == NO_HIT ? std::string("a miss") : fmt::format("prim {} at t {}, u {}, v {}", prim, t, u, v);
  };
  const Ray& r = e.ray;
  return fmt::format(
      "ray {} ({} {} {}, t_min {}, direction {} {} {}, t_max {}): {}{}: the answer is {}; exact is {}: {}", e.index,
      r.origin.x, r.origin.y, r.origin.z, r.t_min, r.dir.x, r.dir.y, r.dir.z, r.t_max, name_of(e.kind),
      e.within_bound ? " within the bound" : "", hit(e.answer.prim, e.answer.t, e.answer.u, e.answer.v),
      hit(e.truth.prim, e.truth.t, e.truth.u, e.truth.v), e.reason);
}

ErrorFigures error_figures(const ExactOracle& exact, const Oracle& bound, std::span<const Ray> rays,
                           std::span<const Hit> answers, std::span<const ExactHit> truth, Want want,
                           Arithmetic arithmetic, std::size_t max_cases) {
  if (rays.size() != answers.size() || rays.size() != truth.size())
    fail(Failure::Arguments, "error figures: {} rays, {} answers and {} truths; their numbers must agree", rays.size(),
         answers.size(), truth.size());
  const Judge judge(exact, bound, want, arithmetic);
  std::vector<Finding> findings(rays.size());
  for_chunks(rays.size(), kRaysPerErrorsChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) findings[i] = judge.find(rays[i], answers[i], truth[i]);
  });
  ErrorFigures sum;
  for (std::size_t i = 0; i < findings.size(); ++i) {
    count(sum, findings[i]);
    if (!findings[i].wrong || sum.cases.size() >= max_cases) continue;
    sum.cases.push_back({i, rays[i], answers[i], truth[i], *findings[i].wrong, findings[i].within_bound, {}});
    sum.cases.back().reason = reason_of({exact, bound, want, arithmetic}, sum.cases.back());
  }
  sum_up_t(sum, findings);
  return sum;
}

}  // namespace ballot
