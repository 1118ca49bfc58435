// What gives light, as the kernels aim at it. Formats: shaders/shared/render.h, shaders/lib/shade/sky.glsl.
#pragma once

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <span>
#include <vector>

#include "engine/scene/scene.h"
#include "shaders/shared/render.h"

namespace ballot {

/// Triangles that emit, chosen by area times `emitted` of their material.
struct EmitterTable {
  std::vector<glm::uvec4> texels;  // of BIND_EMITTERS
  float total = 0;                 // the last texel's sum
};

/// `emitted` has a weight for each material; those of 0 have no triangle here, nor has a triangle without area.
EmitterTable emitter_table(const Scene& scene, std::span<const float> emitted);

std::vector<GpuLight> gpu_lights(const Scene& scene);

std::vector<glm::uvec4> sky_texels(const Sky& sky);

/// Of linear Rec.709.
float luminance(const glm::vec3& color);

}  // namespace ballot
