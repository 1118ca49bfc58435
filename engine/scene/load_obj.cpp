// Loads OBJ with MTL: the faces become flat triangles in file order.
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <unordered_map>

#include "engine/scene/loaders.h"
#include "engine/scene/obj_file.h"
#include "engine/scene/polygon.h"

namespace ballot {
namespace {

/// The faces of a file, cut into triangles.
struct Cut {
  std::vector<std::array<std::uint32_t, 3>> corners;  // per triangle, into ObjFile::corners
  std::vector<std::uint32_t> face;                    // per triangle, into ObjFile::faces
};

Cut cut_faces(const ObjFile& file) {
  Cut cut;
  cut.corners.reserve(file.corners.size() - 2 * file.faces.size());
  cut.face.reserve(cut.corners.capacity());
  std::vector<glm::vec3> polygon;
  for (std::size_t f = 0; f < file.faces.size(); ++f) {
    const ObjFace& face = file.faces[f];
    if (face.count == 3) {
      cut.corners.push_back({face.first, face.first + 1, face.first + 2});
    } else {
      polygon.clear();
      for (std::uint32_t i = 0; i < face.count; ++i)
        polygon.push_back(file.vertices[static_cast<std::size_t>(file.corners[face.first + i].vertex)]);
      const std::size_t start = cut.corners.size();
      triangulate(polygon, cut.corners);
      for (std::size_t t = start; t < cut.corners.size(); ++t)
        for (std::uint32_t& corner : cut.corners[t]) corner += face.first;
    }
    cut.face.resize(cut.corners.size(), static_cast<std::uint32_t>(f));
  }
  return cut;
}

/// The normals of smoothing groups: the mean normal of a vertex's triangles of one group, weighted by their angle at
/// the vertex.
class SmoothNormals {
 public:
  SmoothNormals(const ObjFile& file, const Cut& cut, const std::vector<Triangle>& triangles) {
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      const ObjFace& face = file.faces[cut.face[t]];
      if (face.smoothing == 0) continue;
      const glm::dvec3 a{triangles[t][0]}, b{triangles[t][1]}, c{triangles[t][2]};
      const glm::dvec3 normal = glm::cross(b - a, c - a);
      if (!(glm::length(normal) > 0)) continue;
      const glm::dvec3 unit = glm::normalize(normal);
      for (std::size_t k = 0; k < 3; ++k) {
        const glm::dvec3 here{triangles[t][k]};
        const glm::dvec3 p = glm::dvec3{triangles[t][(k + 1) % 3]} - here,
                         q = glm::dvec3{triangles[t][(k + 2) % 3]} - here;
        sums_[key(face, file.corners[cut.corners[t][k]])] +=
            std::atan2(glm::length(glm::cross(p, q)), glm::dot(p, q)) * unit;
      }
    }
  }

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
  std::unordered_map<std::uint64_t, glm::dvec3> sums_;
};

void add_normals(const ObjFile& file, const Cut& cut, Scene& scene) {
  const bool given = std::ranges::any_of(file.corners, [](const ObjCorner& c) { return c.normal >= 0; });
  const bool smoothed = std::ranges::any_of(file.faces, [](const ObjFace& f) { return f.smoothing != 0; });
  if (!given && !smoothed) return;
  const SmoothNormals smooth(file, cut, scene.triangles);
  scene.normals.reserve(scene.triangles.size());
  for (std::size_t t = 0; t < scene.triangles.size(); ++t) {
    const ObjFace& face = file.faces[cut.face[t]];
    std::array<glm::vec3, 3> normals{};
    for (std::size_t k = 0; k < 3; ++k) {
      const ObjCorner& corner = file.corners[cut.corners[t][k]];
      if (corner.normal >= 0) {
        const glm::dvec3 n{file.normals[static_cast<std::size_t>(corner.normal)]};
        const double length = glm::length(n);
        if (length > 1e-30 && std::isfinite(length)) normals[k] = glm::vec3{n / length};
      } else {
        normals[k] = smooth.at(face, corner);
      }
      if (normals[k] == glm::vec3{0}) normals[k] = geometric_normal(scene.triangles[t]);
    }
    scene.normals.push_back(normals);
  }
}

}  // namespace

Scene load_obj(const std::filesystem::path& path, const LoadOptions& options) {
  ObjFile file = read_obj(path, options);
  const Cut cut = cut_faces(file);
  if (cut.corners.size() > kMaxTriangles)
    fail_in(path, "has {} triangles; expected at most {}; use a smaller scene", cut.corners.size(), kMaxTriangles);
  Scene scene;
  scene.notes = std::move(file.notes);
  scene.materials = std::move(file.materials);
  scene.triangles.reserve(cut.corners.size());
  scene.material_of.reserve(cut.corners.size());
  const auto absent = static_cast<std::uint32_t>(scene.materials.size());
  for (std::size_t t = 0; t < cut.corners.size(); ++t) {
    const std::uint32_t material = file.faces[cut.face[t]].material;
    scene.material_of.push_back(material == kNoMaterial ? absent : material);
    Triangle& triangle = scene.triangles.emplace_back();
    for (std::size_t k = 0; k < 3; ++k)
      triangle[k] = file.vertices[static_cast<std::size_t>(file.corners[cut.corners[t][k]].vertex)];
  }
  if (std::ranges::find(scene.material_of, absent) != scene.material_of.end())
    scene.materials.push_back({.name = "default"});
  add_normals(file, cut, scene);
  return scene;
}

}  // namespace ballot
