#include "engine/files/gltf_texture.h"

#include <array>
#include <cmath>
#include <vector>

#include "engine/core/file.h"
#include "engine/files/gltf_accessor.h"
#include "engine/files/loaders.h"
#include "engine/files/named_file.h"
#include "engine/files/texture.h"

namespace ballot {

namespace {

Wrap wrap_of(int code) {
  if (code == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE) return Wrap::Clamp;
  return code == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT ? Wrap::Mirror : Wrap::Repeat;
}

std::array<double, 2> pair_of(const tinygltf::Value& object, const char* key, double otherwise) {
  if (!object.Has(key)) return {otherwise, otherwise};
  const tinygltf::Value& value = object.Get(key);
  if (!value.IsArray() || value.ArrayLen() != 2) return {otherwise, otherwise};
  return {value.Get(0).GetNumberAsDouble(), value.Get(1).GetNumberAsDouble()};
}

// Sets the rows to translation * rotation * scale, as KHR_texture_transform defines them.
void apply_transform(const tinygltf::Value& transform, TextureUse& use) {
  const auto offset = pair_of(transform, "offset", 0), scale = pair_of(transform, "scale", 1);
  const double angle = transform.Has("rotation") ? transform.Get("rotation").GetNumberAsDouble() : 0;
  const double c = std::cos(angle), s = std::sin(angle);
  use.row_u = glm::vec3(c * scale[0], s * scale[1], offset[0]);
  use.row_v = glm::vec3(-s * scale[0], c * scale[1], offset[1]);
  if (transform.Has("texCoord")) use.set = static_cast<std::uint32_t>(index_in(transform.Get("texCoord")));
}

/// Makes G, the roughness, of A, the glossiness. There is no metal: B is 0.
void to_roughness(TextureImage& image) {
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) {
    image.rgba[i + 1] = static_cast<std::uint8_t>(255 - image.rgba[i + 3]);
    image.rgba[i + 2] = 0;
  }
}

}  // namespace

TextureUse GltfTextures::use(int index, int set, const tinygltf::ExtensionMap& extensions, Texels texels,
                             const std::string& place) {
  TextureUse use;
  if (index == -1 || is_absent(index)) return use;
  use.texture = texture(index, texels, place);
  use.set = static_cast<std::uint32_t>(set);
  const auto transform = extensions.find("KHR_texture_transform");
  if (transform != extensions.end() && transform->second.IsObject()) apply_transform(transform->second, use);
  if (use.set >= kUvSets)
    refuse("{} uses texture coordinates {}; Ballot reads TEXCOORD_0 to TEXCOORD_{}; export it with fewer", place,
           use.set, kUvSets - 1);
  return use;
}

int GltfTextures::source_of(int index) const {
  const tinygltf::Texture& from = file_.model.textures[static_cast<std::size_t>(index)];
  const auto webp = from.extensions.find("EXT_texture_webp");
  if (webp != from.extensions.end() && webp->second.IsObject() && webp->second.Has("source") &&
      webp->second.Get("source").IsNumber())
    return webp->second.Get("source").GetNumberAsInt();
  return from.source;
}

bool GltfTextures::is_absent(int index) {
  const auto& textures = file_.model.textures;
  const auto& images = file_.model.images;
  if (index < 0 || static_cast<std::size_t>(index) >= textures.size()) return false;
  const int source = source_of(index);
  if (source == -1 && absent_.insert(-1).second)
    scene_.notes.push_back(
        fmt::format("The {} has no PNG, JPEG or WebP, so it was left out; so are others like it.",
                    label("texture", static_cast<std::size_t>(index), textures[static_cast<std::size_t>(index)].name)));
  if (source == -1) return true;
  if (source < 0 || static_cast<std::size_t>(source) >= images.size()) return false;
  const tinygltf::Image& from = images[static_cast<std::size_t>(source)];
  if (from.bufferView != -1 || from.uri.empty()) return false;
  const std::string name = label("image", static_cast<std::size_t>(source), from.name);
  const auto path = named_file(file_.path, decoded_uri(from.uri), file_.options.allow_outside, name);
  std::error_code error;
  if (std::filesystem::exists(path, error)) return false;
  if (absent_.insert(source).second)
    scene_.notes.push_back(fmt::format("There is no file {}, so the {} was left out; its materials keep their factors.",
                                       path.string(), name));
  return true;
}

std::uint32_t GltfTextures::texture(int index, Texels texels, const std::string& place) {
  const auto& textures = file_.model.textures;
  if (index < 0 || static_cast<std::size_t>(index) >= textures.size())
    refuse("{} names texture {}, but the file has {}", place, index, textures.size());
  const auto [entry, fresh] = textures_.try_emplace({index, texels}, 0);
  if (!fresh) return entry->second;
  const tinygltf::Texture& from = textures[static_cast<std::size_t>(index)];
  const std::string name = label("texture", static_cast<std::size_t>(index), from.name);
  Texture to;
  if (from.sampler != -1) {
    if (from.sampler < 0 || static_cast<std::size_t>(from.sampler) >= file_.model.samplers.size())
      refuse("{} names sampler {}, but the file has {}", name, from.sampler, file_.model.samplers.size());
    const tinygltf::Sampler& sampler = file_.model.samplers[static_cast<std::size_t>(from.sampler)];
    to.wrap_u = wrap_of(sampler.wrapS);
    to.wrap_v = wrap_of(sampler.wrapT);
    to.nearest = sampler.magFilter == TINYGLTF_TEXTURE_FILTER_NEAREST;
  }
  to.image = image(source_of(index), texels, name);
  scene_.textures.push_back(to);
  return entry->second = static_cast<std::uint32_t>(scene_.textures.size() - 1);
}

std::uint32_t GltfTextures::image(int index, Texels texels, const std::string& place) {
  const auto& images = file_.model.images;
  if (index < 0 || static_cast<std::size_t>(index) >= images.size())
    refuse("{} names image {}, but the file has {}", place, index, images.size());
  const auto [entry, fresh] = images_.try_emplace({index, texels}, 0);
  if (!fresh) return entry->second;
  const tinygltf::Image& from = images[static_cast<std::size_t>(index)];
  const bool srgb = texels == Texels::Color;
  const std::string name = file_.path.string() + ": " + label("image", static_cast<std::size_t>(index), from.name);
  if (from.bufferView != -1) {
    const CheckedBytes bytes =
        open_buffer_view(file_, from.bufferView, label("image", static_cast<std::size_t>(index), from.name));
    scene_.images.push_back(decode_image(bytes.bytes(), name, srgb));
  } else if (from.uri.empty()) {
    scene_.images.push_back(decode_image(from.image, name, srgb));
  } else {
    const auto path = named_file(file_.path, decoded_uri(from.uri), file_.options.allow_outside,
                                 label("image", static_cast<std::size_t>(index), from.name));
    const auto bytes = read_file(path);
    scene_.images.push_back(decode_image({reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()},
                                         name + " in " + path.string(), srgb));
  }
  if (texels == Texels::Glossiness) to_roughness(scene_.images.back());
  return entry->second = static_cast<std::uint32_t>(scene_.images.size() - 1);
}

}  // namespace ballot
