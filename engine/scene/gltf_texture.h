// Textures of glTF materials, decoded when a material in use wants them. Internal to engine/scene.
#pragma once

#include <map>
#include <string>
#include <utility>

#include "engine/scene/gltf_file.h"
#include "engine/scene/scene.h"

namespace ballot {

/// Collects the textures and images that materials ask for into a scene, each once.
class GltfTextures {
 public:
  /// Keeps references to both.
  GltfTextures(const GltfFile& file, Scene& scene) : file_(file), scene_(scene) {}

  /// How a material uses a texture (`index` -1: not at all), with KHR_texture_transform. `place` names the material in
  /// errors. Throws Error(Work) if the file names what it has not, or the image cannot be read or decoded.
  TextureUse use(int index, int set, const tinygltf::ExtensionMap& extensions, bool srgb, const std::string& place);

 private:
  std::uint32_t texture(int index, bool srgb, const std::string& place);
  std::uint32_t image(int index, bool srgb, const std::string& place);

  const GltfFile& file_;
  Scene& scene_;
  std::map<std::pair<int, bool>, std::uint32_t> textures_, images_;  // by index in the file, and sRGB or linear
};

}  // namespace ballot
