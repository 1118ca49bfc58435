#include "engine/oracle/errors.h"

#include "engine/oracle/error_findings.h"
#include "engine/oracle/error_reasons.h"

namespace ballot {
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
  return figures_of(Judge(exact, bound, want, arithmetic), {rays, answers, truth}, max_cases,
                    [&](const ErrorCase& error) {
                      return reason_of({exact, bound, want, arithmetic}, error);
                    });
}

}  // namespace ballot
