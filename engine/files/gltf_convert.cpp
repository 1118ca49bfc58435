#include "engine/files/gltf_convert.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <map>
#include <string_view>

#include "engine/files/loaders.h"
#include "engine/model/placing.h"

namespace ballot {
namespace {

double extension_number(const tinygltf::ExtensionMap& extensions, const char* extension, const char* key,
                        double otherwise) {
  const auto found = extensions.find(extension);
  if (found == extensions.end() || !found->second.IsObject() || !found->second.Has(key)) return otherwise;
  const tinygltf::Value& value = found->second.Get(key);
  return value.IsNumber() ? value.GetNumberAsDouble() : otherwise;
}

glm::vec3 color(const std::vector<double>& from, const glm::vec3& otherwise) {
  if (from.size() < 3) return otherwise;
  return {static_cast<float>(from[0]), static_cast<float>(from[1]), static_cast<float>(from[2])};
}

float clamped(double value) { return static_cast<float>(std::clamp(value, 0.0, 1.0)); }

Alpha alpha_mode(const GltfFile& file, std::size_t index) {
  const tinygltf::Material& from = file.model.materials[index];
  if (from.alphaMode == "MASK") return Alpha::Mask;
  if (from.alphaMode == "BLEND") return Alpha::Blend;
  if (from.alphaMode == "OPAQUE" || from.alphaMode.empty()) return Alpha::Opaque;
  refuse("{} has the alphaMode '{}'; expected OPAQUE, MASK or BLEND", label("material", index, from.name),
         from.alphaMode);
}

/// Returns KHR_materials_pbrSpecularGlossiness of a material; null without it, or if pbrMetallicRoughness, which Ballot
/// models whole, gives a colour.
const tinygltf::Value* glossiness_of(const tinygltf::Material& from) {
  const auto found = from.extensions.find(kSpecularGlossiness);
  const bool other = from.values.contains("baseColorFactor") || from.values.contains("baseColorTexture");
  return found == from.extensions.end() || !found->second.IsObject() || other ? nullptr : &found->second;
}

/// Returns the use of a texture that the extension names.
TextureUse gloss_texture(const tinygltf::Value& from, const char* key, Texels texels, GltfTextures& textures,
                         const std::string& place) {
  if (!from.Has(key) || !from.Get(key).IsObject()) return {};
  const tinygltf::Value& info = from.Get(key);
  tinygltf::ExtensionMap extensions;
  if (info.Has("extensions"))
    for (const std::string& name : info.Get("extensions").Keys()) extensions[name] = info.Get("extensions").Get(name);
  return textures.use(index_in(info.Get("index")), info.Has("texCoord") ? index_in(info.Get("texCoord")) : 0,
                      extensions, texels, place);
}

/// Reads the diffuse colour and the glossiness. The specular colour is left out.
void read_glossiness(const tinygltf::Value& from, Material& to) {
  if (from.Has("diffuseFactor") && from.Get("diffuseFactor").ArrayLen() == 4) {
    const auto factor = [&](int i) { return from.Get("diffuseFactor").Get(i).GetNumberAsDouble(); };
    to.base_color = {factor(0), factor(1), factor(2)};
    to.alpha = clamped(factor(3));
  }
  const bool given = from.Has("glossinessFactor") && from.Get("glossinessFactor").IsNumber();
  const bool texture = from.Has("specularGlossinessTexture");  // has the roughness then
  to.metallic = 0;
  to.roughness = texture ? 1 : clamped(1 - (given ? from.Get("glossinessFactor").GetNumberAsDouble() : 1));
}

void read_textures(const tinygltf::Material& from, const std::string& place, GltfTextures& textures, Material& to) {
  const auto& surface = from.pbrMetallicRoughness;
  const auto use = [&](const auto& info, bool srgb) {
    return textures.use(info.index, info.texCoord, info.extensions, srgb ? Texels::Color : Texels::Linear, place);
  };
  if (const tinygltf::Value* gloss = glossiness_of(from)) {
    to.base_texture = gloss_texture(*gloss, "diffuseTexture", Texels::Color, textures, place);
    to.surface_texture = gloss_texture(*gloss, "specularGlossinessTexture", Texels::Glossiness, textures, place);
  } else {
    to.base_texture = use(surface.baseColorTexture, true);
    to.surface_texture = use(surface.metallicRoughnessTexture, false);
  }
  if (to.unlit) return;
  if (to.emits()) to.emissive_texture = use(from.emissiveTexture, true);
  to.normal_texture = use(from.normalTexture, false);
  to.normal_scale = static_cast<float>(from.normalTexture.scale);
}

}  // namespace

Material convert_material(const GltfFile& file, std::size_t index, GltfTextures* textures,
                          std::vector<std::string>& notes) {
  const tinygltf::Material& from = file.model.materials[index];
  Material to{.name = from.name.empty() ? fmt::format("material{}", index) : from.name};
  const std::vector<double>& base = from.pbrMetallicRoughness.baseColorFactor;
  to.base_color = color(base, glm::vec3{1});
  if (base.size() == 4) to.alpha = clamped(base[3]);
  to.alpha_mode = alpha_mode(file, index);
  to.alpha_cutoff = static_cast<float>(from.alphaCutoff);
  to.unlit = from.extensions.contains("KHR_materials_unlit");
  // tinygltf sets metallic to 1 even if pbrMetallicRoughness is absent. `values` holds only what the file gives.
  if (!from.values.empty()) {
    to.metallic = clamped(from.pbrMetallicRoughness.metallicFactor);
    to.roughness = clamped(from.pbrMetallicRoughness.roughnessFactor);
  }
  if (const tinygltf::Value* gloss = glossiness_of(from)) read_glossiness(*gloss, to);
  const double strength = extension_number(from.extensions, "KHR_materials_emissive_strength", "emissiveStrength", 1);
  to.emissive = color(from.emissiveFactor, glm::vec3{0}) * static_cast<float>(strength);
  to.transmission = clamped(extension_number(from.extensions, "KHR_materials_transmission", "transmissionFactor", 0));
  const double ior = extension_number(from.extensions, "KHR_materials_ior", "ior", 1.5);
  if (ior >= 1) {
    to.ior = static_cast<float>(ior);
  } else {
    notes.push_back(
        fmt::format("The {} has the index of refraction {}; 1.5 was used.", label("material", index, from.name), ior));
  }
  if (textures) read_textures(from, label("material", index, from.name), *textures, to);
  return to;
}

void note_unmodelled(const GltfFile& file, const std::set<std::size_t>& used, std::vector<std::string>& notes) {
  constexpr std::array<std::string_view, 5> kModelled{"KHR_materials_emissive_strength", "KHR_materials_transmission",
                                                      "KHR_materials_ior", "KHR_materials_unlit", kSpecularGlossiness};
  std::map<std::string, std::size_t> counts;
  std::size_t glossy = 0;
  for (const std::size_t i : used) {
    if (i >= file.model.materials.size()) continue;  // the default material
    glossy += glossiness_of(file.model.materials[i]) ? 1 : 0;
    for (const auto& [name, value] : file.model.materials[i].extensions)
      if (std::ranges::find(kModelled, name) == kModelled.end()) ++counts[name];
  }
  for (const auto& [name, count] : counts)
    notes.push_back(fmt::format("{} is not modelled: {} {} without it.", name, count,
                                count == 1 ? "material is drawn" : "materials are drawn"));
  if (glossy > 0)
    notes.push_back(fmt::format("{} is read as diffuse colour and glossiness, without the specular colour: {} {}.",
                                kSpecularGlossiness, glossy, glossy == 1 ? "material" : "materials"));
}

NodeTransform node_transform(const GltfFile& file, std::size_t index) {
  const tinygltf::Node& node = file.model.nodes[index];
  const auto check = [&](const char* key, const std::vector<double>& values, std::size_t count) {
    if (!values.empty() && values.size() != count)
      refuse("{} has a {} of {} numbers; expected {}", label("node", index, node.name), key, values.size(), count);
    return !values.empty();
  };
  NodeTransform to;
  if (check("matrix", node.matrix, 16)) {
    glm::dmat4& m = to.matrix.emplace(1);
    for (int column = 0; column < 4; ++column)
      for (int row = 0; row < 4; ++row) m[column][row] = node.matrix[static_cast<std::size_t>(4 * column + row)];
    return to;
  }
  const auto triple = [](const std::vector<double>& v) { return glm::dvec3{v[0], v[1], v[2]}; };
  if (check("rotation", node.rotation, 4))
    to.rotation = {node.rotation[0], node.rotation[1], node.rotation[2], node.rotation[3]};
  if (check("scale", node.scale, 3)) to.scale = triple(node.scale);
  if (check("translation", node.translation, 3)) to.translation = triple(node.translation);
  return to;
}

View convert_camera(const GltfFile& file, std::size_t node, const glm::dmat4& world_from_node, std::size_t number) {
  const tinygltf::Node& from = file.model.nodes[node];
  const auto& cameras = file.model.cameras;
  if (from.camera < 0 || static_cast<std::size_t>(from.camera) >= cameras.size())
    refuse("{} names camera {}, but the file has {}", label("node", node, from.name), from.camera, cameras.size());
  const tinygltf::Camera& camera = cameras[static_cast<std::size_t>(from.camera)];
  View view{.name = !from.name.empty()     ? from.name
                    : !camera.name.empty() ? camera.name
                                           : fmt::format("view{}", number)};
  view.world_from_camera = without_scale(world_from_node);
  view.orthographic = camera.type == "orthographic";
  const double size = view.orthographic ? camera.orthographic.ymag : camera.perspective.yfov;
  const double most = view.orthographic ? 1e30 : 3.14159;
  if (!(std::abs(size) > 0 && std::abs(size) < most))
    refuse("camera {} has the {} {}; expected more than 0 and less than {}", from.camera,
           view.orthographic ? "ymag" : "yfov", size, most);
  (view.orthographic ? view.ymag : view.yfov) = std::abs(size);
  for (int axis = 0; axis < 3; ++axis)
    if (!std::isfinite(view.world_from_camera[3][axis]))
      refuse("{} puts its camera at {}; expected finite numbers", label("node", node, from.name),
             view.world_from_camera[3][axis]);
  return view;
}

bool has_light(const tinygltf::Node& node) {
  const auto found = node.extensions.find("KHR_lights_punctual");
  return found != node.extensions.end() && found->second.IsObject() && found->second.Has("light");
}

Light convert_light(const GltfFile& file, std::size_t node, const glm::dmat4& world_from_node) {
  const tinygltf::Node& owner = file.model.nodes[node];
  const int index = index_in(owner.extensions.at("KHR_lights_punctual").Get("light"));
  const auto& lights = file.model.lights;
  const std::string place = label("node", node, owner.name);
  if (index < 0 || static_cast<std::size_t>(index) >= lights.size())
    refuse("{} names light {}, but the file has {}", place, index, lights.size());
  const tinygltf::Light& from = lights[static_cast<std::size_t>(index)];
  Light to{.name = from.name.empty() ? fmt::format("light{}", index) : from.name};
  if (from.type == "directional")
    to.kind = Light::Kind::Directional;
  else if (from.type == "spot")
    to.kind = Light::Kind::Spot;
  else if (from.type != "point")
    refuse("light {} has the type '{}'; expected point, spot or directional", index, from.type);
  place_light(to, world_from_node);
  to.intensity = color(from.color, glm::vec3{1}) * static_cast<float>(from.intensity);
  to.range = static_cast<float>(std::max(from.range, 0.0));
  to.inner_angle = static_cast<float>(from.spot.innerConeAngle);
  to.outer_angle = static_cast<float>(from.spot.outerConeAngle);
  for (int axis = 0; axis < 3; ++axis)
    if (!std::isfinite(to.position[axis]) || !std::isfinite(to.intensity[axis]) || to.intensity[axis] < 0)
      refuse("{} puts light {} of intensity {} at {}; expected finite numbers, and no intensity below 0", place, index,
             to.intensity[axis], to.position[axis]);
  return to;
}

}  // namespace ballot
