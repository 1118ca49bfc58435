// Reads MTL materials with tinyobjloader and converts them to Ballot's.
#include <tiny_obj_loader.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

#include "engine/core/file.h"
#include "engine/scene/obj_file.h"

namespace ballot {
namespace {

glm::vec3 color(const tinyobj::real_t (&from)[3], float most) {
  const auto component = [most](tinyobj::real_t c) { return std::isfinite(c) ? std::clamp(c, 0.0f, most) : 0.0f; };
  return {component(from[0]), component(from[1]), component(from[2])};
}

float largest(const glm::vec3& c) { return std::max({c.x, c.y, c.z}); }

/// Converts a material. Illumination models 4, 6, 7 and 9 become glass. A dissolve d below 1 becomes a transmission of
/// 1 - d. Models 3 and 5 become mirrors if a component of Ks is at least 0.5. Else Pm and Pr give metallic and
/// roughness; without Pr a Phong exponent n becomes the roughness (2 / (n + 2))^(1/4), the usual match of the lobes.
Material convert(const tinyobj::material_t& from) {
  constexpr float kMirrorSpecular = 0.5f;
  const glm::vec3 specular = color(from.specular, 1);
  Material to{.name = from.name, .base_color = color(from.diffuse, 1)};
  to.emissive = color(from.emission, 1e6f);
  const bool glass = from.illum == 4 || from.illum == 6 || from.illum == 7 || from.illum == 9;
  const float dissolve = std::isfinite(from.dissolve) ? std::clamp(from.dissolve, 0.0f, 1.0f) : 1.0f;
  if (glass || dissolve < 1) {
    to.transmission = glass ? 1.0f : 1.0f - dissolve;
    to.ior = from.ior > 1 && from.ior < 10 ? from.ior : (glass ? 1.5f : 1.0f);  // an absent Ni reads as 1
    to.roughness = 0;
    const glm::vec3 filter = color(from.transmittance, 1);
    if (largest(filter) > 0) to.base_color = filter;
    if (largest(to.base_color) <= 0) to.base_color = glm::vec3{1};
    return to;
  }
  if ((from.illum == 3 || from.illum == 5) && largest(specular) >= kMirrorSpecular) {
    to.metallic = 1;
    to.roughness = 0;
    to.base_color = specular;
    return to;
  }
  if (from.metallic > 0) to.metallic = std::min(from.metallic, 1.0f);
  if (from.roughness > 0)
    to.roughness = std::min(from.roughness, 1.0f);
  else if (largest(specular) > 0 && from.shininess > 0 && std::isfinite(from.shininess))
    to.roughness = std::pow(2.0f / (from.shininess + 2.0f), 0.25f);
  return to;
}

}  // namespace

bool read_mtl(const std::filesystem::path& path, std::vector<Material>& materials) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) return false;
  const std::vector<std::byte> bytes = read_file(path);
  std::istringstream stream(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  std::map<std::string, int> indices;
  std::vector<tinyobj::material_t> read;
  std::string warning, failure;
  tinyobj::LoadMtl(&indices, &read, &stream, &warning, &failure);
  for (const tinyobj::material_t& material : read)
    if (!material.name.empty()) materials.push_back(convert(material));
  return true;
}

}  // namespace ballot
