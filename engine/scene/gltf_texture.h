// The textures of glTF materials. They are decoded only if a material in use needs them. Internal to engine/scene.
#pragma once

#include <map>
#include <set>
#include <string>
#include <utility>

#include "engine/scene/gltf_file.h"
#include "engine/scene/scene.h"

namespace ballot {

/// Adds the textures and images that materials use to a scene, each once.
class GltfTextures {
 public:
  /// Keeps references to both arguments.
  GltfTextures(const GltfFile& file, Scene& scene) : file_(file), scene_(scene) {}

  /// Returns a material's use of texture `index` with coordinate set `set`, including KHR_texture_transform; an index
  /// of -1 gives no texture. So does, with a note, an image whose file does not exist or that is of a kind that Ballot
  /// does not decode (KHR_texture_basisu). `place` names the material in
  /// errors. Throws Error(Work) if the file refers to something that it does not contain, or the image cannot
  /// be read or decoded.
  TextureUse use(int index, int set, const tinygltf::ExtensionMap& extensions, bool srgb, const std::string& place);

 private:
  bool is_absent(int index);
  /// Returns the image of a texture: WebP if it has one, else PNG or JPEG; -1: none of these.
  int source_of(int index) const;
  std::uint32_t texture(int index, bool srgb, const std::string& place);
  std::uint32_t image(int index, bool srgb, const std::string& place);

  const GltfFile& file_;
  Scene& scene_;
  std::set<int> absent_;                                             // images whose files do not exist
  std::map<std::pair<int, bool>, std::uint32_t> textures_, images_;  // key: index in the file; sRGB or linear
};

}  // namespace ballot
