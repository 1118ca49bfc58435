// Lookups by name in the registries of traversal methods and numeric modes.
#include "engine/answer/methods.h"
#include "engine/answer/numeric.h"
#include "engine/core/registry.h"
#include "engine/gpu/context.h"

namespace ballot {

const Method& find_method(std::string_view name) { return find_named(kMethods, name, "traversal method"); }

const NumericMode& find_numeric(std::string_view name) { return find_named(kNumericModes, name, "numeric mode"); }

void check_takes(const NumericMode& mode, std::uint32_t shapes) {
  if (!shapes || mode.takes_shapes) return;
  std::string others;
  for (const NumericMode& m : kNumericModes)
    if (m.takes_shapes) others += fmt::format("{}{}", others.empty() ? "" : ", ", m.name);
  fail(Failure::Arguments,
       "numeric mode {} is one of triangles, and the scene has shapes (spheres and the like); modes with them: {}",
       mode.name, others);
}

const NumericMode& find_numeric(std::string_view name, const DeviceInfo& device) {
  const NumericMode& mode = find_numeric(name);
  if (!mode.needs_float64 || device.float64) return mode;
  std::string others;
  for (const NumericMode& m : kNumericModes)
    if (!m.needs_float64) others += fmt::format("{}{}", others.empty() ? "" : ", ", m.name);
  fail(Failure::Arguments,
       "numeric mode {} needs double precision (shaderFloat64), which {} lacks; modes without it: {}", name,
       device.name, others);
}

}  // namespace ballot
