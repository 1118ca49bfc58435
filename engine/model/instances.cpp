#include "engine/model/instances.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <limits>

#include "engine/core/error.h"
#include "engine/core/memory.h"
#include "engine/core/parallel.h"

namespace ballot {
namespace {

constexpr float kLargestColumn = 0x1p+60f;

glm::vec3 moved_vertex(const glm::vec3& v, const Transform& t) {
  glm::vec3 to;
  for (int r = 0; r < 3; ++r)
    to[r] = static_cast<float>(double(t.m[r][0]) * v.x + double(t.m[r][1]) * v.y + double(t.m[r][2]) * v.z +
                               double(t.m[r][3]));
  return to;
}

Bounds united(const Bounds& a, const Bounds& b) { return {glm::min(a.lo, b.lo), glm::max(a.hi, b.hi)}; }

bool holds(const Bounds& outer, const Bounds& inner) {
  return glm::min(outer.lo, inner.lo) == outer.lo && glm::max(outer.hi, inner.hi) == outer.hi;
}

constexpr Bounds kNothing{glm::vec3(std::numeric_limits<float>::infinity()),
                          glm::vec3(-std::numeric_limits<float>::infinity())};

Bounds bounds_of_moved(std::span<const Triangle> triangles, const Transform& t) {
  const auto of = [&](std::size_t begin, std::size_t end) {
    Bounds to = kNothing;
    for (const Triangle& triangle : triangles.subspan(begin, end - begin))
      for (const glm::vec3& vertex : triangle) {
        const glm::vec3 v = moved_vertex(vertex, t);
        to = united(to, {v, v});
      }
    return to;
  };
  return joined_chunks(triangles.size(), 1 << 15, kNothing, of, united);
}

}  // namespace

double spread_of(const Transform& t) {
  double of_matrix = 0, of_inverse = 0, det = 0;
  double a[3][3];  // the cofactors, which are the inverse times the determinant
  for (int r = 0; r < 3; ++r) {
    double sum = 0;
    for (int c = 0; c < 3; ++c) {
      const int p = (c + 1) % 3, q = (c + 2) % 3, u = (r + 1) % 3, v = (r + 2) % 3;
      a[c][r] = double(t.m[u][p]) * t.m[v][q] - double(t.m[u][q]) * t.m[v][p];
      sum += std::abs(double(t.m[r][c]));
      if (r == 0) det += t.m[0][c] * a[c][0];
    }
    of_matrix = std::max(of_matrix, sum);
  }
  for (const auto& row : a) of_inverse = std::max(of_inverse, std::abs(row[0]) + std::abs(row[1]) + std::abs(row[2]));
  const double spread = of_matrix * of_inverse / std::abs(det);
  return std::isnan(spread) ? std::numeric_limits<double>::infinity() : spread;
}

bool is_placeable(const Transform& t) {
  for (const auto& row : t.m)
    for (const float x : row)
      if (!std::isfinite(x)) return false;
  for (int c = 0; c < 3; ++c) {
    const float most = std::max({std::abs(t.m[0][c]), std::abs(t.m[1][c]), std::abs(t.m[2][c])});
    if (most < 1 / kLargestColumn || most > kLargestColumn) return false;
  }
  return spread_of(t) <= kMostSpread;
}

glm::dmat4 not_quite_hidden(glm::dmat4 matrix) {
  constexpr double kShortest = 1 / double(kLargestColumn);
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r)
      if (!(std::abs(matrix[c][r]) < kShortest)) return matrix;
  for (int c = 0; c < 3; ++c) {
    matrix[c] = glm::dvec4(0);
    matrix[c][c] = 2 * kShortest;
  }
  return matrix;
}

bool is_identity(const Transform& t) {
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 4; ++c)
      if (t.m[r][c] != (r == c ? 1.0f : 0.0f)) return false;
  return true;
}

Triangle moved(const Triangle& triangle, const Transform& t) {
  return {moved_vertex(triangle[0], t), moved_vertex(triangle[1], t), moved_vertex(triangle[2], t)};
}

Bounds moved(const Bounds& box, const Transform& t) {
  Bounds to = kNothing;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::vec3 v = moved_vertex(
        {corner & 1 ? box.hi.x : box.lo.x, corner & 2 ? box.hi.y : box.lo.y, corner & 4 ? box.hi.z : box.lo.z}, t);
    to = united(to, {v, v});
  }
  return to;
}

std::uint64_t triangle_count(const Scene& scene) {
  if (!scene.instanced()) return scene.triangles.size();
  std::uint64_t count = 0;
  for (const Placement& p : scene.instances.placements) count += scene.instances.triangles_of(p.mesh);
  return count;
}

UnsetVector<Triangle> world_triangles(const Scene& scene) {
  if (!scene.instanced()) return scene.triangles;
  const std::uint64_t count = triangle_count(scene);
  need_memory(count * sizeof(Triangle), fmt::format("a list of the {} triangles of scene '{}'", count, scene.name));
  UnsetVector<Triangle> all(count);
  for_each_triangle(scene, [&](std::size_t placement, std::size_t triangle, std::uint32_t prim) {
    all[prim] = moved(scene.triangles[triangle], scene.instances.placements[placement].transform);
  });
  return all;
}

Bounds bounds_of_mesh(const Scene& scene, std::size_t mesh) {
  const SceneInstances& all = scene.instances;
  if (all.triangles_of(mesh) == 0) return {};
  return bounds_of_moved(std::span(scene.triangles).subspan(all.first[mesh], all.triangles_of(mesh)), {});
}

// Most instances lie within the bounds of others, which shows without their vertices: those whose boxes reach
// farthest are taken first.
Bounds bounds_of_instances(const Scene& scene) {
  const TreeLayout all = tree_layout(scene);
  const auto triangles_of = [&](std::size_t mesh) {
    return std::span(scene.triangles).subspan(all.first[mesh], all.first[mesh + 1] - all.first[mesh]);
  };
  std::vector<Bounds> of_mesh(all.first.size() - 1, kNothing);
  for (std::size_t m = 0; m < of_mesh.size(); ++m) of_mesh[m] = bounds_of_moved(triangles_of(m), {});
  std::vector<std::size_t> order;  // of the instances that have triangles
  std::vector<Bounds> boxes(all.placements.size());
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const Placement& p = all.placements[i];
    if (triangles_of(p.mesh).empty()) continue;
    boxes[i] = moved(of_mesh[p.mesh], p.transform);
    order.push_back(i);
  }
  if (order.empty()) return {};
  std::vector<std::size_t> first;
  for (int axis = 0; axis < 3; ++axis) {
    first.push_back(*std::ranges::min_element(order, {}, [&](std::size_t i) { return boxes[i].lo[axis]; }));
    first.push_back(*std::ranges::max_element(order, {}, [&](std::size_t i) { return boxes[i].hi[axis]; }));
  }
  order.insert(order.begin(), first.begin(), first.end());
  Bounds bounds = kNothing;
  for (const std::size_t i : order) {
    if (holds(bounds, boxes[i])) continue;
    const Placement& p = all.placements[i];
    const bool corners = all.kinds[p.mesh] == ShapeKind::Triangles;  // of what stands in for shapes they tell no bounds
    bounds = united(bounds, corners ? bounds_of_moved(triangles_of(p.mesh), p.transform) : boxes[i]);
  }
  return bounds;
}

TreeLayout tree_layout(const Scene& scene) {
  const SceneInstances& all = scene.instances;
  std::vector<bool> joins(all.meshes());  // a mesh shares the tree of the one before it
  for (std::size_t p = 1; p < all.placements.size(); ++p) {
    const std::uint32_t before = all.placements[p - 1].mesh, mesh = all.placements[p].mesh;
    joins[mesh] = mesh == before + 1 && all.mesh_labels[mesh].in_world && all.mesh_labels[before].in_world;
  }
  TreeLayout to;
  to.tree_of.resize(all.meshes());
  for (std::size_t m = 0; m < to.tree_of.size(); ++m) {
    if (!joins[m]) to.first.push_back(all.first[m]), to.kinds.push_back(all.mesh_labels[m].kind);
    to.tree_of[m] = static_cast<std::uint32_t>(to.first.size() - 1);
  }
  to.first.push_back(all.first.back());
  to.placements.reserve(all.placements.size());
  to.prims.reserve(all.placements.size());
  to.from.reserve(all.placements.size());
  std::uint32_t prim = 0;
  for (std::uint32_t i = 0; i < all.placements.size(); ++i) {
    const Placement& p = all.placements[i];
    const std::uint32_t first = prim;
    prim += static_cast<std::uint32_t>(all.triangles_of(p.mesh));
    if (joins[p.mesh] || p.mask == 0) continue;
    to.placements.push_back({to.tree_of[p.mesh], p.transform, kMeetsAll, p.group});
    to.prims.push_back(first);
    to.from.push_back(i);
  }
  to.prims.push_back(prim);
  return to;
}

void check_instances(const Scene& scene) {
  const SceneInstances& all = scene.instances;
  if (all.first.empty() || all.first.front() != 0 || all.first.back() != scene.triangles.size() ||
      !std::ranges::is_sorted(all.first))
    fail(Failure::Arguments, "scene '{}': the meshes of its instances are no ranges that make up its {} triangles",
         scene.name, scene.triangles.size());
  std::uint64_t count = 0;
  for (std::size_t i = 0; i < all.placements.size(); ++i) {
    const Placement& p = all.placements[i];
    if (p.mesh >= all.meshes())
      fail(Failure::Arguments, "instance {}: its mesh is number {}, but there are {} meshes", i, p.mesh, all.meshes());
    count += all.triangles_of(p.mesh);
    if (count > kMostPrims)
      fail(Failure::Arguments,
           "instance {}: with it the scene has {} triangles, counted through its instances; at most {} can be numbered",
           i, count, kMostPrims);
  }
}

void check_spreads(const Scene& scene) {
  const std::vector<Placement>& all = scene.instances.placements;
  for (std::size_t i = 0; i < all.size(); ++i)
    if (!is_placeable(all[i].transform))
      fail(Failure::Arguments,
           "scene '{}': the matrix of instance {} is not finite, singular, or multiplies rounding errors by {:.3g}; "
           "pictures and rays of a view take at most {}, and columns of 2^-60 to 2^60; place a moved copy of the mesh "
           "instead",
           scene.name, scene.instances.placement_labels[i].number, spread_of(all[i].transform), kMostSpread);
}

}  // namespace ballot
