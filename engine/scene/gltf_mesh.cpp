#include "engine/scene/gltf_mesh.h"

#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>

#include "engine/scene/loaders.h"

namespace ballot {
namespace {

std::size_t triangle_count(int mode, std::size_t corners) {
  if (mode == TINYGLTF_MODE_TRIANGLES) return corners / 3;
  return corners < 3 ? 0 : corners - 2;
}

/// Returns the corner numbers of triangle i, in the order of the glTF 2.0 specification, section 3.7.2.1.
std::array<std::size_t, 3> corners_of(int mode, std::size_t i) {
  switch (mode) {
    case TINYGLTF_MODE_TRIANGLE_STRIP:
      return {i, i + 1 + i % 2, i + 2 - i % 2};
    case TINYGLTF_MODE_TRIANGLE_FAN:
      return {i + 1, i + 2, 0};
    default:
      return {3 * i, 3 * i + 1, 3 * i + 2};
  }
}

/// Transforms a point in double and rounds it once. The sum runs from left to right, so any repetition in double gives
/// the same bits.
glm::vec3 transform(const glm::dmat4& m, const glm::dvec3& p) {
  return glm::vec3{m[0][0] * p.x + m[1][0] * p.y + m[2][0] * p.z + m[3][0],
                   m[0][1] * p.x + m[1][1] * p.y + m[2][1] * p.z + m[3][1],
                   m[0][2] * p.x + m[1][2] * p.y + m[2][2] * p.z + m[3][2]};
}

std::vector<glm::vec3> world_positions(const GltfFile& file, const OpenPrimitive& primitive,
                                       const glm::dmat4& world_from_node) {
  std::vector<glm::vec3> world(primitive.positions.size());
  for (std::size_t i = 0; i < world.size(); ++i) {
    const glm::dvec3 p = primitive.positions.vec3(i);
    world[i] = transform(world_from_node, p);
    if (!std::isfinite(world[i].x) || !std::isfinite(world[i].y) || !std::isfinite(world[i].z))
      fail_in(file.path,
              "{} vertex {} is ({}, {}, {}) in the file and ({}, {}, {}) in the world; expected finite numbers",
              primitive.place, i, p.x, p.y, p.z, world[i].x, world[i].y, world[i].z);
  }
  return world;
}

/// Returns the inverse transpose up to a positive factor: the cofactors, with the sign of the determinant.
glm::dmat3 normal_matrix(const glm::dmat4& m) {
  const glm::dvec3 a{m[0]}, b{m[1]}, c{m[2]};
  const double sign = glm::dot(glm::cross(a, b), c) < 0 ? -1 : 1;
  return {sign * glm::cross(b, c), sign * glm::cross(c, a), sign * glm::cross(a, b)};
}

/// Returns the unit vector, or zero if the normal is too short or not finite.
glm::vec3 unit_or_zero(const glm::dvec3& n) {
  const double length = glm::length(n);
  return length > 1e-30 && std::isfinite(length) ? glm::vec3{n / length} : glm::vec3{0};
}

std::vector<glm::vec3> world_normals(const OpenPrimitive& primitive, const glm::dmat4& world_from_node) {
  std::vector<glm::vec3> world(primitive.normals ? primitive.positions.size() : 0);
  const glm::dmat3 turn = normal_matrix(world_from_node);
  for (std::size_t i = 0; i < world.size(); ++i)
    world[i] = unit_or_zero(turn * glm::dvec3{unit_or_zero(primitive.normals->vec3(i))});
  return world;
}

std::uint32_t material_index(const GltfFile& file, int index, const std::string& place) {
  const std::size_t count = file.model.materials.size();
  if (index == -1) return static_cast<std::uint32_t>(count);  // glTF's default material, appended by load_gltf
  if (index < 0 || static_cast<std::size_t>(index) >= count)
    fail_in(file.path, "{} names material {}, but the file has {}", place, index, count);
  return static_cast<std::uint32_t>(index);
}

void open_attributes(const GltfFile& file, const tinygltf::Primitive& from, OpenPrimitive& to) {
  to.positions = open_positions(file, from.attributes.at("POSITION"), to.place + " POSITION");
  if (from.indices != -1) to.indices = open_indices(file, from.indices, to.place + " indices");
  if (const auto normal = from.attributes.find("NORMAL"); normal != from.attributes.end()) {
    to.normals = open_normals(file, normal->second, to.place + " NORMAL");
    if (to.normals->size() < to.positions.size())
      fail_in(file.path, "{} has {} normals for {} vertices; expected as many", to.place, to.normals->size(),
              to.positions.size());
  }
  for (std::size_t set = 0; set < kUvSets; ++set) {
    const std::string name = fmt::format("TEXCOORD_{}", set);
    const auto uv = from.attributes.find(name);
    if (uv == from.attributes.end()) continue;
    to.uvs[set] = open_uvs(file, uv->second, to.place + " " + name);
    if (to.uvs[set]->size() < to.positions.size())
      fail_in(file.path, "{} has {} texture coordinates for {} vertices; expected as many", to.place,
              to.uvs[set]->size(), to.positions.size());
  }
}

/// Appends the texture coordinates of a triangle, untransformed. Coordinates that are not finite become (0, 0).
void append_uvs(const OpenPrimitive& primitive, const std::array<std::size_t, 3>& corners, const Carried& carried,
                Scene& scene) {
  for (std::size_t set = 0; set < kUvSets; ++set) {
    if (!carried.uvs[set]) continue;
    std::array<glm::vec2, 3>& uvs = scene.uvs[set].emplace_back(std::array<glm::vec2, 3>{});
    if (!primitive.uvs[set]) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      uvs[k] = glm::vec2(primitive.uvs[set]->vec2(corners[k]));
      if (!std::isfinite(uvs[k].x) || !std::isfinite(uvs[k].y)) uvs[k] = glm::vec2(0);
    }
  }
}

}  // namespace

std::optional<OpenPrimitive> open_primitive(GltfFile& file, std::size_t mesh, std::size_t primitive) {
  const tinygltf::Mesh& owner = file.model.meshes[mesh];
  const tinygltf::Primitive& from = owner.primitives[primitive];
  OpenPrimitive to{.mesh = mesh, .primitive = primitive};
  to.place = fmt::format("{} primitive {}", label("mesh", mesh, owner.name), primitive);
  to.mode = from.mode;
  if (from.mode < TINYGLTF_MODE_TRIANGLES || from.mode > TINYGLTF_MODE_TRIANGLE_FAN) {
    if (from.mode < TINYGLTF_MODE_POINTS || from.mode > TINYGLTF_MODE_TRIANGLE_FAN)
      fail_in(file.path, "{} has mode {}; expected 0 to 6", to.place, from.mode);
    file.notes.push_back(fmt::format("{} (mode {}: points or lines) was ignored.", to.place, from.mode));
    return std::nullopt;
  }
  if (!from.attributes.contains("POSITION")) {
    file.notes.push_back(fmt::format("{} has no POSITION and was left out.", to.place));
    return std::nullopt;
  }
  to.material = material_index(file, from.material, to.place);
  open_attributes(file, from, to);
  const std::size_t corners = to.indices ? to.indices->size() : to.positions.size();
  to.triangle_count = triangle_count(from.mode, corners);
  if (from.mode == TINYGLTF_MODE_TRIANGLES && corners % 3 != 0)
    file.notes.push_back(fmt::format("{} has {} corners, not a multiple of 3; the last {} were left out.", to.place,
                                     corners, corners % 3));
  if (!from.targets.empty()) file.notes.push_back(fmt::format("The morph targets of {} were ignored.", to.place));
  return to;
}

void append_primitive(const GltfFile& file, const OpenPrimitive& primitive, const glm::dmat4& world_from_node,
                      const Carried& carried, Scene& scene) {
  const std::vector<glm::vec3> positions = world_positions(file, primitive, world_from_node);
  const std::vector<glm::vec3> normals = world_normals(primitive, world_from_node);
  const float facing = glm::dot(glm::cross(glm::dvec3{world_from_node[0]}, glm::dvec3{world_from_node[1]}),
                                glm::dvec3{world_from_node[2]}) < 0
                           ? -1.0f
                           : 1.0f;  // a mirroring transform reverses the winding, but not the surface
  for (std::size_t i = 0; i < primitive.triangle_count; ++i) {
    std::array<std::size_t, 3> corners = corners_of(primitive.mode, i);
    Triangle triangle;
    for (std::size_t k = 0; k < 3; ++k) {
      if (primitive.indices) {
        const std::size_t index = primitive.indices->index(corners[k]);
        if (index >= positions.size())
          fail_in(file.path, "{} index {} is {}, but it has {} vertices; export it again", primitive.place, corners[k],
                  index, positions.size());
        corners[k] = index;
      }
      triangle[k] = positions[corners[k]];
    }
    scene.triangles.push_back(triangle);
    scene.material_of.push_back(primitive.material);
    append_uvs(primitive, corners, carried, scene);
    if (!carried.normals) continue;
    std::array<glm::vec3, 3> shading{};
    for (std::size_t k = 0; k < 3; ++k) {
      if (!normals.empty()) shading[k] = normals[corners[k]];
      if (shading[k] == glm::vec3{0}) shading[k] = facing * geometric_normal(triangle);
    }
    scene.normals.push_back(shading);
  }
}

}  // namespace ballot
