// The light sources in the form that the kernels sample. Formats: shaders/shared/render.h, shaders/lib/shade/sky.glsl.
#pragma once

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <span>
#include <vector>

#include "engine/model/scene.h"
#include "shaders/shared/render.h"

namespace ballot {

/// The emissive triangles with the running sums that sample them by area times their material's weight.
struct EmitterTable {
  std::vector<glm::uvec4> texels;  // contents of BIND_EMITTERS
  float total = 0;                 // sum of all weights, in the last texel too
};

/// Returns the table of emissive triangles. `emitted` has a weight for each material. Triangles whose material has
/// weight 0 and triangles without area are left out.
EmitterTable emitter_table(const Scene& scene, std::span<const float> emitted);

/// Returns the punctual lights of a scene, in order.
std::vector<GpuLight> gpu_lights(const Scene& scene);

/// Returns the contents of BIND_SKY.
std::vector<glm::uvec4> sky_texels(const Sky& sky);

/// Returns the luminance of a linear Rec.709 colour.
float luminance(const glm::vec3& color);

}  // namespace ballot
