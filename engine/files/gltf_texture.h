// The textures of glTF materials. They are decoded only if a material in use needs them. Internal to engine/files.
#pragma once

#include <map>
#include <set>
#include <string>
#include <utility>

#include "engine/files/gltf_file.h"
#include "engine/model/scene.h"

namespace ballot {

/// What the texels of an image become: sRGB colours, linear numbers, or roughness (G) of glossiness in A.
enum class Texels { Color, Linear, Glossiness };

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
  TextureUse use(int index, int set, const tinygltf::ExtensionMap& extensions, Texels texels, const std::string& place);

 private:
  bool is_absent(int index);
  /// Returns the image of a texture: WebP if it has one, else PNG or JPEG; -1: none of these.
  int source_of(int index) const;
  std::uint32_t texture(int index, Texels texels, const std::string& place);
  std::uint32_t image(int index, Texels texels, const std::string& place);

  const GltfFile& file_;
  Scene& scene_;
  std::set<int> absent_;                                               // images whose files do not exist
  std::map<std::pair<int, Texels>, std::uint32_t> textures_, images_;  // key: index in the file
};

}  // namespace ballot
