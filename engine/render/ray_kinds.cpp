#include "engine/render/ray_kinds.h"

#include <cmath>

#include "engine/core/error.h"

namespace ballot {

const RayKind& find_ray_kind(std::string_view name) {
  std::string names;
  for (const RayKind& kind : kRayKinds) {
    if (kind.name == name) return kind;
    names += fmt::format("{}{}", names.empty() ? "" : ", ", kind.name);
  }
  fail(Failure::Arguments, "no ray kind is called '{}'; there are: {}", name, names);
}

KernelSource generator_source(std::string_view generator, bool listed) {
  KernelSource source{.name = fmt::format("rays.{}{}", generator, listed ? ".listed" : ""),
                      .file = fmt::format("rays/{}.comp", generator),
                      .defines = {},
                      .constants = {}};
  if (generator == kPrimaryGenerator[0]) source.defines.emplace_back("BALLOT_LISTED", listed);
  return source;
}

void check_options(const RayKindOptions& o) {
  if (o.ao_rays < 1 || o.ao_rays > 64) fail(Failure::Arguments, "{} ao rays a hit are not between 1 and 64", o.ao_rays);
  if (!std::isfinite(o.ao_radius) || o.ao_radius <= 0)
    fail(Failure::Arguments, "an ao radius of {} diagonals is not above 0", o.ao_radius);
}

}  // namespace ballot
