#include "engine/render/batch/ray_kinds.h"

#include <cmath>

#include "engine/core/error.h"
#include "engine/core/registry.h"

namespace ballot {

const RayKind& find_ray_kind(std::string_view name) { return find_named(kRayKinds, name, "ray kind"); }

KernelSource generator_source(std::string_view generator, const OffsetPolicy& offset, const SceneFeatures& features) {
  return {.name = fmt::format("rays.{}.{}{}{}{}", generator, offset.name, features.instances() ? "+instances" : "",
                              features.stored ? "+stored" : "", features.tree.shapes ? "+shapes" : ""),
          .file = fmt::format("rays/{}.comp", generator),
          .defines = {{"BALLOT_ORIGIN", offset.value},
                      {"BALLOT_HAS_INSTANCES", features.instances()},
                      {"BALLOT_STORED", features.stored},
                      {"BALLOT_HAS_SHAPES", features.tree.shapes != 0}}};
}

void check_options(const RayKindOptions& o) {
  if (o.ao_rays < 1 || o.ao_rays > 64)
    fail(Failure::Arguments, "{} ao rays per hit are not between 1 and 64", o.ao_rays);
  if (!std::isfinite(o.ao_radius) || o.ao_radius <= 0)
    fail(Failure::Arguments, "an ao radius of {} diagonals is not above 0", o.ao_radius);
  find_offset_policy(o.offset);
  if (!(o.constant_offset > 0 && o.constant_offset <= 1))
    fail(Failure::Arguments, "a constant offset of {} diagonals is not above 0 and at most 1", o.constant_offset);
}

}  // namespace ballot
