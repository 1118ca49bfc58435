// Loads PLY: the faces become triangles in file order, points spheres or discs.
#include <cmath>
#include <glm/geometric.hpp>
#include <span>

#include "engine/core/memory.h"
#include "engine/files/loaders.h"
#include "engine/files/ply_file.h"
#include "engine/files/polygon.h"

namespace ballot {
namespace {

/// Returns the normals of a triangle's corners: those of the file, or the triangle's own where they are no directions.
std::array<glm::vec3, 3> normals_of(const PlyFile& file, const std::array<std::uint32_t, 3>& corners,
                                    const Triangle& triangle) {
  std::array<glm::vec3, 3> normals;
  for (std::size_t k = 0; k < 3; ++k) {
    const glm::dvec3 n{file.normals[corners[k]]};
    const double length = glm::length(n);
    normals[k] = length > 1e-30 && std::isfinite(length) ? glm::vec3(n / length) : geometric_normal(triangle);
  }
  return normals;
}

Scene points_of(PlyFile& file, const LoadOptions& options) {
  const ShapeInfo& info = options.shapes ? *options.shapes : info_of(ShapeKind::Spheres);
  if (info.vertices > 1 || !info.radii) refuse("its points are no {}; expected spheres or discs", info.name);
  if (info.normals && file.normals.empty()) refuse("its points have no normals nx, ny and nz, but {} do", info.name);
  if (file.radii.empty() && options.radius == 0)
    refuse("its points have no property 'radius' or 'scalar_radius'; expected one, or a radius for all of them");
  if (file.radii.empty()) file.radii.assign(file.vertices.size(), options.radius);
  Scene scene;
  scene.origin = file.origin;
  scene.notes = std::move(file.notes);
  append_shapes(info.kind, {file.vertices, file.radii, file.normals}, scene);
  for (const glm::vec3& color : file.colors) scene.colors.emplace_back().fill(glm::vec4(color, 1));
  complete_shapes(info.kind, scene);
  return scene;
}

}  // namespace

Scene load_ply(const std::filesystem::path& path, const LoadOptions& options) {
  PlyFile file = read_ply(path);
  if (options.shapes || (!file.has_faces && (!file.radii.empty() || options.radius > 0)))
    return points_of(file, options);
  if (!file.has_faces)
    refuse(
        "has no faces, only {} points; expected a mesh with an element 'face' or 'tristrips', or points with a "
        "property 'radius', or a radius for all of them",
        file.vertices.size());
  Scene scene;
  scene.origin = file.origin;
  scene.notes = std::move(file.notes);
  std::vector<glm::vec3> polygon;
  std::vector<std::array<std::uint32_t, 3>> cut;
  TangledPolygons tangled;
  const std::size_t count = file.corners.size() - 2 * file.face_ends.size();
  scene.triangles.reserve(count);
  if (!file.normals.empty()) scene.normals.reserve(count);
  if (!file.colors.empty()) scene.colors.reserve(count);
  std::uint32_t first = 0, released = 0;
  for (const std::uint32_t& end : file.face_ends) {
    if (constexpr std::uint32_t kTogether = 1 << 18; first - released >= kTogether) {
      release_pages(std::as_bytes(std::span(file.corners).subspan(released, first - released)));
      released = first;
    }
    polygon.clear();
    cut.clear();
    for (std::uint32_t i = first; i < end; ++i) polygon.push_back(file.vertices[file.corners[i]]);
    if (end - first == 3)
      cut.push_back({0, 1, 2});
    else
      tangled.add(triangulate(polygon, cut), [&] { return fmt::format("face {}", &end - file.face_ends.data()); });
    for (std::array<std::uint32_t, 3> corners : cut) {
      const Triangle& triangle =
          scene.triangles.emplace_back(Triangle{polygon[corners[0]], polygon[corners[1]], polygon[corners[2]]});
      for (std::uint32_t& corner : corners) corner = file.corners[first + corner];
      if (!file.normals.empty()) scene.normals.push_back(normals_of(file, corners, triangle));
      if (file.colors.empty()) continue;
      std::array<glm::vec4, 3>& colors = scene.colors.emplace_back();
      for (std::size_t k = 0; k < 3; ++k) colors[k] = glm::vec4(file.colors[corners[k]], 1);
    }
    first = end;
    if (scene.triangles.size() > kMaxTriangles)
      refuse("has more than {} triangles; use a smaller scene", kMaxTriangles);
  }
  tangled.note(scene.notes);
  complete_mesh(scene);
  return scene;
}

}  // namespace ballot
