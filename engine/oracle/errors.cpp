#include "engine/oracle/errors.h"

#include <cmath>

#include "engine/oracle/error_findings.h"
#include "engine/oracle/error_reasons.h"

namespace ballot {
namespace {

class Judge {
 public:
  Judge(const ExactOracle& exact, const Oracle& bound, Want want, Arithmetic arithmetic)
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
    if (exact_.compare_t(ray, answer.prim, truth.prim) != 0) return wrong(ErrorKind::WrongPrim, ray, answer, truth);
    return check_values(ray, answer, own, true);
  }

  Finding wrong(ErrorKind kind, const Ray& ray, const Hit& answer, const ExactHit& truth) const {
    const Verdict verdict = bound_.judge(ray, answer, rounded(truth), want_, arithmetic_);
    const bool covered = verdict == Verdict::Tie || verdict == Verdict::Same;
    return {.wrong = kind, .within_bound = covered && arithmetic_ != Arithmetic::Exact};
  }

  // Checks t, u and v of the answer. `own` is the exact hit of the triangle that the answer names.
  Finding check_values(const Ray& ray, const Hit& answer, const ExactHit& own, bool tie) const {
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
  const Judge judge(exact, bound, want, arithmetic);
  return figures_of(judge, {rays, answers, truth}, max_cases, [&](const ErrorCase& error) {
    return reason_of({exact, bound, want, arithmetic}, error);
  });
}

}  // namespace ballot
