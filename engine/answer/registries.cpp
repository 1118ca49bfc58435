// Lookups by name in the registries of traversal methods and numeric modes.
#include "engine/answer/methods.h"
#include "engine/answer/numeric.h"
#include "engine/core/registry.h"
#include "engine/gpu/context.h"

namespace ballot {

const Method& find_method(std::string_view name) { return find_named(kMethods, name, "traversal method"); }

const NumericMode& find_numeric(std::string_view name) { return find_named(kNumericModes, name, "numeric mode"); }

void check_takes(const NumericMode& mode, std::uint32_t shapes) {
  if (!shapes || mode.shapes == TakesShapes::Kernels) return;
  if (mode.shapes == TakesShapes::Host)
    fail(Failure::Arguments,
         "numeric mode {}: the scene has shapes (spheres and the like), among which it finds nearest and any hits of "
         "rays alone, without counters; expected another query, or mode {}",
         mode.name, kDefaultNumeric);
  std::string others;
  for (const NumericMode& m : kNumericModes)
    if (m.shapes != TakesShapes::No) others += fmt::format("{}{}", others.empty() ? "" : ", ", m.name);
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
