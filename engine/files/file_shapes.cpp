// Shapes that scene files hold: their checks, and what stands in for them.
#include <cmath>

#include "engine/files/loaders.h"

namespace ballot {

void append_shapes(ShapeKind kind, const ShapeVertices& vertices, Scene& scene) {
  for (std::size_t i = 0; i < vertices.positions.size(); ++i) {
    const glm::vec3& p = vertices.positions[i];
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
      refuse("{}: vertex {} is ({}, {}, {}); expected finite numbers", info_of(kind).name, i, p.x, p.y, p.z);
  }
  const std::size_t first = scene.triangles.size(), count = vertices.positions.size() / info_of(kind).vertices;
  if (first + count > kMaxTriangles)
    refuse("has more than {} {}; use a smaller scene", kMaxTriangles, info_of(kind).name);
  need_memory_for(count * 2 * (sizeof(Triangle) + sizeof(Shape)), fmt::format("{} {}", count, info_of(kind).name));
  std::vector<Shape> shapes;
  try {
    shapes = make_shapes(kind, {}, vertices, std::string(info_of(kind).name));
  } catch (const Error& e) {
    throw Flaw(e.what());
  }
  const UnsetVector<Triangle> corners = stand_ins(kind, shapes);
  scene.triangles.insert(scene.triangles.end(), corners.begin(), corners.end());
  scene.shapes.resize(first);
  scene.shapes.insert(scene.shapes.end(), shapes.begin(), shapes.end());
}

void complete_shapes(ShapeKind kind, Scene& scene) {
  scene.instances.first = {0, scene.triangles.size()};
  scene.instances.mesh_labels.push_back({.kind = scene.triangles.empty() ? ShapeKind::Triangles : kind});
  scene.materials.push_back({.name = "default"});
}

}  // namespace ballot
