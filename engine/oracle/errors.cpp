#include "engine/oracle/errors.h"

#include "engine/oracle/error_findings.h"
#include "engine/oracle/error_reasons.h"
#include "engine/oracle/in_parallel.h"
#include "engine/oracle/ulp.h"

namespace ballot {

namespace {

/// Judges answers by the two oracles of a scene.
class Judge {
 public:
  Judge(const ExactOracle& exact, const Oracle& bound, Want want, Arithmetic arithmetic)
      : exact_(exact), bound_(bound), want_(want), arithmetic_(arithmetic) {}

  Finding find(const Ray& ray, const Hit& answer, const ExactHit& truth) const {
    const Finding finding = find_in_range(ray, answer, truth);
    if (finding.wrong.has_value() == is_dead(ray)) return finding;  // right on a live ray, or a hit of a dead one
    return is_beyond_range(ray, bound_.scene().bounds(), arithmetic_) ? Finding{.beyond_range = true} : finding;
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
    const Verdict verdict = bound_.judge(ray, answer, truth, want_, arithmetic_);
    const bool covered = verdict == Verdict::Tie || verdict == Verdict::Same;
    return {.wrong = kind, .within_bound = covered && arithmetic_ != Arithmetic::Exact};
  }

  /// Checks t, u and v of the answer. `own` is the exact hit of the triangle that the answer names.
  Finding check_values(const Ray& ray, const Hit& answer, const ExactHit& own, bool tie) const {
    Finding finding;
    finding.tie = tie;
    const double error = in_ulps(std::abs(answer.t - own.t), own.t);
    if (std::isfinite(error)) finding.t_ulp = error;
    if (bound_.judge_values(ray, answer, own, want_, arithmetic_) == Verdict::Same) return finding;
    finding.tie = false;
    finding.wrong = ErrorKind::WrongValue;
    return finding;
  }

  const ExactOracle& exact_;
  const Oracle& bound_;
  Want want_;
  Arithmetic arithmetic_;
};

std::string place_text(const Forest& forest, std::uint32_t prim) {
  if (prim >= forest.triangle_count()) return "no triangle";
  const Forest::Place at = forest.place_of(prim);
  return fmt::format("triangle {} of instance {}", at.triangle, at.instance);
}

std::string reason_among(const Forest& forest, const ErrorCase& e) {
  if (e.answer.prim == NO_HIT) return fmt::format("the ray hits {}", place_text(forest, e.truth.prim));
  const std::string named = place_text(forest, e.answer.prim);
  if (e.truth.prim == NO_HIT || e.kind == ErrorKind::WrongValue) return fmt::format("the answer names {}", named);
  return fmt::format("the answer names {}; right is {}", named, place_text(forest, e.truth.prim));
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
  const Answers of{rays, answers, truth};
  check_sizes(of);
  const Judge judge(exact, bound, want, arithmetic);
  std::vector<Finding> findings(rays.size());
  for_chunks(findings.size(), kRaysOfInstances, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) findings[i] = judge.find(rays[i], answers[i], truth[i]);
  });
  ErrorFigures sum = sum_of(findings);
  add_cases(sum, findings, of, max_cases, [&](const ErrorCase& error) {
    const Forest* forest = exact.scene().forest();
    return forest ? reason_among(*forest, error) : reason_of({exact, bound, want, arithmetic}, error);
  });
  return sum;
}

}  // namespace ballot
