#include "engine/files/gltf_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "engine/files/loaders.h"
#include "engine/model/placing.h"

namespace ballot {
namespace {

/// Returns the number of triangles, lines or points that corners make.
std::size_t piece_count(int mode, std::size_t corners) {
  switch (mode) {
    case TINYGLTF_MODE_POINTS:
      return corners;
    case TINYGLTF_MODE_LINE:
      return corners / 2;
    case TINYGLTF_MODE_LINE_LOOP:
      return corners < 2 ? 0 : corners;
    case TINYGLTF_MODE_LINE_STRIP:
      return corners < 2 ? 0 : corners - 1;
    case TINYGLTF_MODE_TRIANGLES:
      return corners / 3;
    default:
      return corners < 3 ? 0 : corners - 2;
  }
}

ShapeKind shapes_of(int mode) {
  if (mode == TINYGLTF_MODE_POINTS) return ShapeKind::Spheres;
  return mode <= TINYGLTF_MODE_LINE_STRIP ? ShapeKind::Capsules : ShapeKind::Triangles;
}

/// Returns the corner numbers of triangle, line or point i of `count`, in the order of the glTF 2.0 specification,
/// section 3.7.2.1.
std::array<std::size_t, 3> corners_of(int mode, std::size_t i, std::size_t count) {
  switch (mode) {
    case TINYGLTF_MODE_POINTS:
      return {i, i, i};
    case TINYGLTF_MODE_LINE:
      return {2 * i, 2 * i + 1, 2 * i + 1};
    case TINYGLTF_MODE_LINE_LOOP:
      return {i, (i + 1) % count, (i + 1) % count};
    case TINYGLTF_MODE_LINE_STRIP:
      return {i, i + 1, i + 1};
    case TINYGLTF_MODE_TRIANGLE_STRIP:
      return {i, i + 1 + i % 2, i + 2 - i % 2};
    case TINYGLTF_MODE_TRIANGLE_FAN:
      return {i + 1, i + 2, 0};
    default:
      return {3 * i, 3 * i + 1, 3 * i + 2};
  }
}

std::vector<glm::vec3> world_positions(const OpenPrimitive& primitive, const glm::dmat4& world_from_node) {
  std::vector<glm::vec3> world(primitive.positions.size());
  for (std::size_t i = 0; i < world.size(); ++i) {
    const glm::dvec3 p = primitive.positions.vec3(i);
    world[i] = transform_point(world_from_node, p);
    if (!std::isfinite(world[i].x) || !std::isfinite(world[i].y) || !std::isfinite(world[i].z))
      refuse("{} vertex {} is ({}, {}, {}) in the file and ({}, {}, {}) in the world; expected finite numbers",
             primitive.place, i, p.x, p.y, p.z, world[i].x, world[i].y, world[i].z);
  }
  return world;
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
    refuse("{} names material {}, but the file has {}", place, index, count);
  return static_cast<std::uint32_t>(index);
}

void open_attributes(const GltfFile& file, const tinygltf::Primitive& from, OpenPrimitive& to) {
  to.positions = open_positions(file, from.attributes.at("POSITION"), to.place + " POSITION");
  if (from.indices != -1) to.indices = open_indices(file, from.indices, to.place + " indices");
  if (const auto normal = from.attributes.find("NORMAL"); normal != from.attributes.end()) {
    to.normals = open_normals(file, normal->second, to.place + " NORMAL");
    if (to.normals->size() < to.positions.size())
      refuse("{} has {} normals for {} vertices; expected as many", to.place, to.normals->size(), to.positions.size());
  }
  if (const auto color = from.attributes.find("COLOR_0"); color != from.attributes.end()) {
    to.colors = open_colors(file, color->second, to.place + " COLOR_0", to.color_alpha);
    if (to.colors->size() < to.positions.size())
      refuse("{} has {} colours for {} vertices; expected as many", to.place, to.colors->size(), to.positions.size());
  }
  for (std::size_t set = 0; set < kUvSets; ++set) {
    const std::string name = fmt::format("TEXCOORD_{}", set);
    const auto uv = from.attributes.find(name);
    if (uv == from.attributes.end()) continue;
    to.uvs[set] = open_uvs(file, uv->second, to.place + " " + name);
    if (to.uvs[set]->size() < to.positions.size())
      refuse("{} has {} texture coordinates for {} vertices; expected as many", to.place, to.uvs[set]->size(),
             to.positions.size());
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

/// Appends the colours of a triangle. One that is not finite, or below 0, becomes 0.
void append_colors(const OpenPrimitive& primitive, const std::array<std::size_t, 3>& corners, Scene& scene) {
  std::array<glm::vec4, 3>& colors = scene.colors.emplace_back();
  colors.fill(glm::vec4(1));
  if (!primitive.colors) return;
  for (std::size_t k = 0; k < 3; ++k)
    for (int c = 0; c < (primitive.color_alpha ? 4 : 3); ++c) {
      const auto value = static_cast<float>(primitive.colors->component(corners[k], static_cast<std::size_t>(c)));
      colors[k][c] = std::isfinite(value) ? std::max(value, 0.0f) : 0.0f;
    }
}

}  // namespace

std::optional<OpenPrimitive> open_primitive(GltfFile& file, std::size_t mesh, std::size_t primitive) {
  const tinygltf::Mesh& owner = file.model.meshes[mesh];
  const tinygltf::Primitive& from = owner.primitives[primitive];
  OpenPrimitive to{.mesh = mesh, .primitive = primitive};
  to.place = fmt::format("{} primitive {}", label("mesh", mesh, owner.name), primitive);
  to.mode = from.mode;
  if (from.mode < TINYGLTF_MODE_POINTS || from.mode > TINYGLTF_MODE_TRIANGLE_FAN)
    refuse("{} has mode {}; expected 0 to 6", to.place, from.mode);
  to.shapes = shapes_of(from.mode);
  if (to.shapes != ShapeKind::Triangles && file.options.radius == 0) {
    file.notes.push_back(fmt::format(
        "{} (mode {}: points or lines) was ignored; with a radius they are spheres or capsules.", to.place, from.mode));
    return std::nullopt;
  }
  if (!from.attributes.contains("POSITION")) {
    file.notes.push_back(fmt::format("{} has no POSITION and was left out.", to.place));
    return std::nullopt;
  }
  to.material = material_index(file, from.material, to.place);
  open_attributes(file, from, to);
  const std::size_t corners = to.indices ? to.indices->size() : to.positions.size();
  to.triangle_count = piece_count(from.mode, corners);
  if (from.mode == TINYGLTF_MODE_TRIANGLES && corners % 3 != 0)
    file.notes.push_back(fmt::format("{} has {} corners, not a multiple of 3; the last {} were left out.", to.place,
                                     corners, corners % 3));
  return to;
}

std::array<std::size_t, 3> primitive_corners(const OpenPrimitive& primitive, std::size_t i) {
  std::array<std::size_t, 3> corners = corners_of(primitive.mode, i, primitive.triangle_count);
  if (!primitive.indices) return corners;
  for (std::size_t& corner : corners) {
    const std::size_t index = primitive.indices->index(corner);
    if (index >= primitive.positions.size())
      refuse("{} index {} is {}, but it has {} vertices; export it again", primitive.place, corner, index,
             primitive.positions.size());
    corner = index;
  }
  return corners;
}

void append_primitive(const OpenPrimitive& primitive, const glm::dmat4& world_from_node, bool turned,
                      const Carried& carried, Scene& scene) {
  const std::vector<glm::vec3> positions = world_positions(primitive, world_from_node);
  const std::vector<glm::vec3> normals = world_normals(primitive, world_from_node);
  const float facing = turned == mirrors(world_from_node) ? 1.0f : -1.0f;  // of the corners' order
  for (std::size_t i = 0; i < primitive.triangle_count; ++i) {
    std::array<std::size_t, 3> corners = primitive_corners(primitive, i);
    if (turned) std::swap(corners[1], corners[2]);
    const Triangle triangle{positions[corners[0]], positions[corners[1]], positions[corners[2]]};
    scene.triangles.push_back(triangle);
    scene.material_of.push_back(primitive.material);
    append_uvs(primitive, corners, carried, scene);
    if (carried.colors) append_colors(primitive, corners, scene);
    if (!carried.normals) continue;
    std::array<glm::vec3, 3> shading{};
    for (std::size_t k = 0; k < 3; ++k) {
      if (!normals.empty()) shading[k] = normals[corners[k]];
      if (shading[k] == glm::vec3{0}) shading[k] = facing * geometric_normal(triangle);
    }
    scene.normals.push_back(shading);
  }
}

void append_primitive_shapes(const OpenPrimitive& primitive, const glm::dmat4& world_from_node, float radius,
                             const Carried& carried, Scene& scene) {
  const std::size_t first = scene.triangles.size(), vertices = info_of(primitive.shapes).vertices;
  append_primitive(primitive, world_from_node, false, carried, scene);
  std::vector<glm::vec3> positions;
  for (const Triangle& t : std::span(scene.triangles).subspan(first))
    positions.insert(positions.end(), t.begin(), t.begin() + std::ptrdiff_t(vertices));
  scene.triangles.resize(first);
  append_shapes(primitive.shapes, {positions, std::vector<float>(positions.size(), radius)}, scene);
}

}  // namespace ballot
