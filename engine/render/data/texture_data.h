// Textures as the kernels read them. Formats: shaders/shared/render.h.
#pragma once

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <vector>

#include "engine/scene/scene.h"
#include "shaders/shared/render.h"

namespace ballot {

struct PackedTextures {
  std::vector<glm::uvec4> texels;  // linear half RGBA, 8 bytes a texel: every image with its mip maps, a third more
  std::vector<GpuTexture> table;   // one a texture of the scene
  std::vector<glm::vec3> means;    // of each texture's colour, linear
};

PackedTextures pack_textures(const Scene& scene);

/// Texture coordinates, set behind set, those alone that the scene has.
std::vector<glm::uvec4> pack_uvs(const Scene& scene);

/// USES_PER_MATERIAL a material.
std::vector<GpuTextureUse> pack_uses(const Scene& scene);

}  // namespace ballot
