// Textures in the form that the kernels read. Formats: shaders/shared/render.h.
#pragma once

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <vector>

#include "engine/model/scene.h"
#include "shaders/shared/render.h"

namespace ballot {

/// The textures of a scene and their images.
struct PackedTextures {
  std::vector<glm::uvec4> texels;  // linear half RGBA, 8 bytes per texel: every image with its mip maps, a third more
  std::vector<GpuTexture> table;   // one entry per texture of the scene
  std::vector<glm::vec3> means;    // mean colour of each texture, linear
};

/// Returns the textures of a scene, packed.
PackedTextures pack_textures(const Scene& scene);

/// Returns the texture coordinates of the scene, one set after the other; sets that the scene lacks take no texels.
std::vector<glm::uvec4> pack_uvs(const Scene& scene);

/// Returns the colours of the vertices as half RGBA, two texels per triangle.
std::vector<glm::uvec4> pack_colors(const Scene& scene);

/// Returns the texture uses of all materials, USES_PER_MATERIAL for each.
std::vector<GpuTextureUse> pack_uses(const Scene& scene);

}  // namespace ballot
