// Loads OBJ with MTL: the faces become flat triangles in file order.
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <span>
#include <unordered_map>

#include "engine/core/memory.h"
#include "engine/files/loaders.h"
#include "engine/files/obj_file.h"
#include "engine/files/polygon.h"

namespace ballot {
namespace {

/// Cuts the faces into triangles, in file order. each(face, corners) gets the corners of each, as places in
/// ObjFile::corners. behind(f) is called behind face f. Returns the polygons that are not simple.
template <class Each, class Behind>
TangledPolygons for_triangles(const ObjFile& file, Each each, Behind behind) {
  TangledPolygons tangled;
  std::vector<glm::vec3> polygon;
  std::vector<std::array<std::uint32_t, 3>> cut;
  for (std::size_t f = 0; f < file.faces.size(); ++f) {
    const ObjFace& face = file.faces[f];
    if (face.count == 3) {
      each(face, std::array{face.first, face.first + 1, face.first + 2});
    } else {
      polygon.clear();
      cut.clear();
      for (std::uint32_t i = 0; i < face.count; ++i)
        polygon.push_back(file.vertices[static_cast<std::size_t>(file.corners[face.first + i].vertex)]);
      tangled.add(triangulate(polygon, cut), [&] { return fmt::format("line {}", face.line); });
      for (std::array<std::uint32_t, 3>& corners : cut) {
        for (std::uint32_t& corner : corners) corner += face.first;
        each(face, corners);
      }
    }
    behind(f);
  }
  return tangled;
}

/// Returns the vertices of a triangle.
Triangle triangle_at(const ObjFile& file, const std::array<std::uint32_t, 3>& corners) {
  Triangle triangle;
  for (std::size_t k = 0; k < 3; ++k)
    triangle[k] = file.vertices[static_cast<std::size_t>(file.corners[corners[k]].vertex)];
  return triangle;
}

/// The normals of smoothing groups: the mean normal of a vertex's triangles of one group, weighted by their angle at
/// the vertex.
class SmoothNormals {
 public:
  explicit SmoothNormals(const ObjFile& file) {
    smooths_ = std::ranges::any_of(file.faces, [](const ObjFace& f) { return f.smoothing != 0; });
    if (!smooths_) return;
    const auto add = [&](const ObjFace& face, const std::array<std::uint32_t, 3>& corners) {
      if (face.smoothing == 0) return;
      const Triangle triangle = triangle_at(file, corners);
      const glm::dvec3 a{triangle[0]}, b{triangle[1]}, c{triangle[2]};
      const glm::dvec3 normal = glm::cross(b - a, c - a);
      if (!(glm::length(normal) > 0)) return;
      const glm::dvec3 unit = glm::normalize(normal);
      for (std::size_t k = 0; k < 3; ++k) {
        const glm::dvec3 here{triangle[k]};
        const glm::dvec3 p = glm::dvec3{triangle[(k + 1) % 3]} - here, q = glm::dvec3{triangle[(k + 2) % 3]} - here;
        sums_[key(face, file.corners[corners[k]])] += std::atan2(glm::length(glm::cross(p, q)), glm::dot(p, q)) * unit;
      }
    };
    for_triangles(file, add, [](std::size_t) {});
  }

  /// Returns true if no face is in a smoothing group.
  bool empty() const { return !smooths_; }

  /// Returns the normal of a corner; zero if there is none.
  glm::vec3 at(const ObjFace& face, const ObjCorner& corner) const {
    const auto found = sums_.find(key(face, corner));
    if (found == sums_.end()) return glm::vec3{0};
    const double length = glm::length(found->second);
    return length > 1e-9 ? glm::vec3{found->second / length} : glm::vec3{0};
  }

 private:
  static std::uint64_t key(const ObjFace& face, const ObjCorner& corner) {
    return std::uint64_t{face.smoothing} << 32 | static_cast<std::uint32_t>(corner.vertex);
  }
  bool smooths_ = false;
  std::unordered_map<std::uint64_t, glm::dvec3> sums_;
};

/// Returns the normals of a triangle's corners: those of the file, of smoothing groups, or the triangle's own.
std::array<glm::vec3, 3> normals_at(const ObjFile& file, const ObjFace& face,
                                    const std::array<std::uint32_t, 3>& corners, const Triangle& triangle,
                                    const SmoothNormals& smooth) {
  std::array<glm::vec3, 3> normals{};
  for (std::size_t k = 0; k < 3; ++k) {
    const ObjCorner& corner = file.corners[corners[k]];
    if (corner.normal >= 0) {
      const glm::dvec3 n{file.normals[static_cast<std::size_t>(corner.normal)]};
      const double length = glm::length(n);
      if (length > 1e-30 && std::isfinite(length)) normals[k] = glm::vec3{n / length};
    } else {
      normals[k] = smooth.at(face, corner);
    }
    if (normals[k] == glm::vec3{0}) normals[k] = geometric_normal(triangle);
  }
  return normals;
}

/// Returns the colours of a triangle's corners, which are their vertices'.
std::array<glm::vec4, 3> colors_at(const ObjFile& file, const std::array<std::uint32_t, 3>& corners) {
  std::array<glm::vec4, 3> colors{};
  for (std::size_t k = 0; k < 3; ++k)
    colors[k] = glm::vec4(file.colors[static_cast<std::size_t>(file.corners[corners[k]].vertex)], 1);
  return colors;
}

/// Returns the texture coordinates of a triangle's corners; zero where a corner has none, which is counted.
std::array<glm::vec2, 3> coordinates_at(const ObjFile& file, const std::array<std::uint32_t, 3>& corners,
                                        std::size_t& missing) {
  std::array<glm::vec2, 3> at{};
  for (std::size_t k = 0; k < 3; ++k) {
    const std::int32_t index = file.coordinates_of.empty() ? -1 : file.coordinates_of[corners[k]];
    if (index >= 0)
      at[k] = file.coordinates[static_cast<std::size_t>(index)];
    else
      ++missing;
  }
  return at;
}

/// Gives the materials in use their textures. Returns true if one has got one.
bool add_textures(const std::filesystem::path& path, const LoadOptions& options, const ObjFile& file, Scene& scene) {
  std::vector<bool> used(scene.materials.size());
  for (const ObjFace& face : file.faces)
    if (face.material != kNoMaterial) used[face.material] = true;
  read_obj_textures(path, options, file, used, scene);
  return !scene.textures.empty();
}

/// Gives back the memory of faces and corners that have become triangles.
class UsedFaces {
 public:
  explicit UsedFaces(const ObjFile& file) : file_(file) {}
  void operator()(std::size_t face) {
    constexpr std::size_t kTogether = 1 << 16;
    if (face - released_ < kTogether) return;
    const auto release = [](const auto& all, std::size_t begin, std::size_t end) {
      release_pages(std::as_bytes(std::span(all).subspan(begin, end - begin)));
    };
    const std::uint32_t corner = file_.faces[face].first;
    release(file_.corners, corner_, corner);
    release(file_.faces, released_, face);
    released_ = face;
    corner_ = corner;
  }

 private:
  const ObjFile& file_;
  std::size_t released_ = 0, corner_ = 0;
};

/// Makes a mesh of each group as its faces become triangles. Groups of one name have one id.
class GroupMeshes {
 public:
  GroupMeshes(ObjFile& file, Scene& scene) : groups_(file.groups), scene_(scene), to_(scene.instances) {
    to_.names = std::move(file.names);
    before(0);
  }
  /// Begins the mesh that this face is the first of, if there is one.
  void before(std::size_t face) {
    if (next_ == groups_.size() || groups_[next_].first != face) return;
    to_.first.push_back(scene_.triangles.size());
    to_.mesh_labels.push_back({.name = groups_[next_].name, .id = groups_[next_].name});
    ++next_;
  }
  void finish() {
    if (!to_.first.empty()) to_.first.push_back(scene_.triangles.size());
  }

 private:
  const std::vector<ObjGroup>& groups_;
  const Scene& scene_;
  SceneInstances& to_;
  std::size_t next_ = 0;
};

}  // namespace

Scene load_obj(const std::filesystem::path& path, const LoadOptions& options) {
  ObjFile file = read_obj(path, options);
  const std::size_t count = file.corners.size() - 2 * file.faces.size();
  if (count > kMaxTriangles) refuse("has {} triangles; expected at most {}; use a smaller scene", count, kMaxTriangles);
  Scene scene;
  scene.origin = file.origin;
  scene.notes = std::move(file.notes);
  scene.materials = std::move(file.materials);
  const auto absent = static_cast<std::uint32_t>(scene.materials.size());
  const bool given = std::ranges::any_of(file.corners, [](const ObjCorner& c) { return c.normal >= 0; });
  const SmoothNormals smooth(file);
  const bool normals = given || !smooth.empty();
  scene.triangles.reserve(count);
  scene.material_of.reserve(count);
  if (normals) scene.normals.reserve(count);
  if (!file.colors.empty()) scene.colors.reserve(count);
  const bool textured = add_textures(path, options, file, scene);
  if (textured) scene.uvs[0].reserve(count);
  std::size_t without = 0, others = 0;  // corners without texture coordinates
  const auto add = [&](const ObjFace& face, const std::array<std::uint32_t, 3>& corners) {
    scene.material_of.push_back(face.material == kNoMaterial ? absent : face.material);
    const Triangle& triangle = scene.triangles.emplace_back(triangle_at(file, corners));
    if (normals) scene.normals.push_back(normals_at(file, face, corners, triangle, smooth));
    if (!file.colors.empty()) scene.colors.push_back(colors_at(file, corners));
    if (!textured) return;
    const bool shown = face.material != kNoMaterial && scene.materials[face.material].base_texture;
    scene.uvs[0].push_back(coordinates_at(file, corners, shown ? without : others));
  };
  GroupMeshes meshes(file, scene);
  UsedFaces used(file);
  const auto behind = [&](std::size_t face) {
    used(face);
    meshes.before(face + 1);
  };
  for_triangles(file, add, behind).note(scene.notes);
  meshes.finish();
  if (without > 0)
    scene.notes.push_back(
        fmt::format("{} corners of triangles with a texture have no texture coordinates; they are "
                    "(0, 0) there.",
                    without));
  if (std::ranges::find(scene.material_of, absent) != scene.material_of.end())
    scene.materials.push_back({.name = "default"});
  return scene;
}

}  // namespace ballot
