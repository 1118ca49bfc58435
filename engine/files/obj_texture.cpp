// The textures of OBJ files: the images that map_Kd of their materials names.
#include <map>
#include <tuple>

#include "engine/core/file.h"
#include "engine/files/loaders.h"
#include "engine/files/named_file.h"
#include "engine/files/obj_file.h"
#include "engine/files/texture.h"

namespace ballot {
namespace {

/// Adds the images and textures of materials to a scene, each once.
class ObjTextures {
 public:
  ObjTextures(const std::filesystem::path& obj, const LoadOptions& options, Scene& scene)
      : obj_(obj), options_(options), scene_(scene) {}

  /// Returns a material's use of its map. v is turned around: in OBJ (0, 0) is the bottom left corner of the image.
  TextureUse use(const ObjMap& map) {
    const std::uint32_t image = image_of(map);
    if (image == kNoTexture) return {};
    const auto [entry, fresh] = textures_.try_emplace({image, map.clamp}, std::uint32_t(scene_.textures.size()));
    const Wrap wrap = map.clamp ? Wrap::Clamp : Wrap::Repeat;
    if (fresh) scene_.textures.push_back({.image = image, .wrap_u = wrap, .wrap_v = wrap});
    return {.texture = entry->second,
            .row_u = {map.scale.x, 0, map.offset.x},
            .row_v = {0, -map.scale.y, 1 - map.offset.y}};
  }

 private:
  /// Returns the image of a map, which lies beside its MTL file or else beside the scene; kNoTexture: there is none.
  std::uint32_t image_of(const ObjMap& map) {
    std::error_code error;
    std::string name = map.folder.empty() ? map.name : (map.folder / map.name).lexically_normal().string();
    const auto exists = [&] { return std::filesystem::exists(obj_.parent_path() / name, error); };
    if (!map.folder.empty() && !exists()) name = map.name;
    const auto [entry, fresh] = images_.try_emplace(name, kNoTexture);
    if (!fresh) return entry->second;
    std::string reason = why_refused(obj_, name, options_.allow_outside);
    if (reason.empty() && !exists()) reason = "was not found";
    if (reason.empty()) {
      try {
        const std::vector<std::byte> bytes = read_file(obj_.parent_path() / name);
        scene_.images.push_back(decode_image({reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()},
                                             fmt::format("{}: image '{}'", obj_.string(), name), true));
        return entry->second = std::uint32_t(scene_.images.size() - 1);
      } catch (const Error& unusable) {
        reason = fmt::format("cannot be used ({})", unusable.what());
      }
    }
    scene_.notes.push_back(
        fmt::format("The image '{}' {}; it was left out, and its materials keep their colours.", name, reason));
    return kNoTexture;
  }

  const std::filesystem::path& obj_;
  const LoadOptions& options_;
  Scene& scene_;
  std::map<std::string, std::uint32_t> images_;
  std::map<std::pair<std::uint32_t, bool>, std::uint32_t> textures_;  // by image and clamping
};

}  // namespace

void read_obj_textures(const std::filesystem::path& obj, const LoadOptions& options, const ObjFile& file,
                       const std::vector<bool>& used, Scene& scene) {
  ObjTextures textures(obj, options, scene);
  for (std::size_t i = 0; i < file.maps.size(); ++i)
    if (used[i] && !file.maps[i].name.empty()) scene.materials[i].base_texture = textures.use(file.maps[i]);
}

}  // namespace ballot
