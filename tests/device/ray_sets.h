// Named sets of rays on which every method is held to the oracle. Some are adversarial, after Embree's verify and
// pbrt's Reintersect.
#pragma once

#include <string>
#include <vector>

#include "engine/tree/host/bvh.h"
#include "tests/cpu/shapes.h"

namespace ballot::shapes {

struct RaySet {
  std::string name;
  std::vector<Ray> rays;
};

/// Returns the camera rays of a 64 x 64 picture of the bounds, in Morton order.
inline std::vector<Ray> morton_primary(const Bounds& b) {
  const glm::vec3 centre = (b.lo + b.hi) * 0.5f, size = b.hi - b.lo;
  const float extent = std::max({size.x, size.y, size.z, 1e-3f});
  const glm::vec3 eye = centre + glm::vec3(0.3f, 0.4f, 1.5f) * extent;
  std::vector<Ray> out;
  for (std::uint32_t i = 0; i < 4096; ++i) {
    std::uint32_t x = 0, y = 0;
    for (std::uint32_t k = 0; k < 6; ++k) x |= (i >> (2 * k) & 1) << k, y |= (i >> (2 * k + 1) & 1) << k;
    const glm::vec3 at = centre + extent * glm::vec3(float(x) / 64 - 0.5f, 0.5f - float(y) / 64, 0);
    out.push_back(towards(eye, at));
  }
  return out;
}

/// Returns rays from points on the faces of the tree's boxes: inward, outward and along the face.
inline std::vector<Ray> on_box_faces(const Bvh& bvh, std::size_t count) {
  Random random(11);
  std::vector<Ray> out;
  while (out.size() < count) {
    const BvhNode& n = bvh.nodes[random.below(bvh.nodes.size())];
    if (n.hi.x < n.lo.x) continue;
    glm::vec3 p;
    for (int k = 0; k < 3; ++k) p[k] = random.in(n.lo[k], n.hi[k]);
    const int axis = int(random.below(3));
    p[axis] = random.below(2) ? n.lo[axis] : n.hi[axis];
    glm::vec3 d = random.point(1);
    if (random.below(2)) d[axis] = random.below(2) ? 0.f : -0.f;
    if (d != glm::vec3(0)) out.push_back({p, 0, d, 1e30f});
  }
  return out;
}

/// Returns rays that start on triangles, with t_min 0, and rays towards triangles with t_max just before, at and after
/// them.
inline std::vector<Ray> on_triangles(const Triangles& triangles, std::size_t count) {
  Random random(12);
  std::vector<Ray> out;
  while (out.size() < count) {
    const Triangle& t = triangles[random.below(triangles.size())];
    const float u = random.in(0, 1), v = random.in(0, 1 - u);
    const glm::vec3 p = t[0] * (1 - u - v) + t[1] * u + t[2] * v, d = random.point(1);
    const float ends[] = {std::nextafter(1.f, 0.f), 1.f, std::nextafter(1.f, 2.f), 1 - 1e-4f, 1 + 1e-4f};
    if (random.below(2))
      out.push_back({p, 0, d, 1e30f});
    else
      out.push_back({p - d, 0, d, ends[random.below(5)]});
  }
  return out;
}

/// Returns rays that lie in the plane of a triangle, nearly or exactly.
inline std::vector<Ray> grazing(const Triangles& triangles, std::size_t count) {
  Random random(13);
  std::vector<Ray> out;
  while (out.size() < count) {
    const Triangle& t = triangles[random.below(triangles.size())];
    const glm::vec3 along = t[1] - t[0], middle = (t[0] + t[1] + t[2]) / 3.f;
    const float tilt = random.below(2) ? 0.f : random.in(-1e-5f, 1e-5f);
    const glm::vec3 d = along + glm::cross(along, t[2] - t[0]) * tilt;
    if (d != glm::vec3(0)) out.push_back({middle - d * 3.f, 0, d, 1e30f});
  }
  return out;
}

/// Returns rays with directions of unusual length, some with negative t_min, some from far away.
inline std::vector<Ray> odd_scales(std::size_t count) {
  Random random(14);
  std::vector<Ray> out;
  const float scales[] = {1e-15f, 1e-6f, 1e6f, 1e15f};
  while (out.size() < count) {
    const float s = scales[random.below(4)];
    const glm::vec3 from = random.point(random.below(2) ? 2.f : 1e4f), d = (random.point(1) - from) * s;
    out.push_back({from, random.below(2) ? 0.f : -1 / s, d, 1e20f});
  }
  return out;
}

/// Returns all sets of rays for a scene. Most counts are not multiples of a subgroup or workgroup.
inline std::vector<RaySet> ray_sets(const Triangles& triangles, const Bvh& bvh) {
  std::vector<RaySet> sets{{"random", random_rays(1999)},
                           {"dead", dead_rays()},
                           {"one ray", random_rays(1)},
                           {"seven rays", random_rays(7)},
                           {"odd scales", odd_scales(501)}};
  std::vector<Ray> mixed = random_rays(333, 21);  // dead and live rays side by side in a subgroup
  for (std::size_t i = 0; i < mixed.size(); i += 3) mixed[i] = dead_rays()[i % dead_rays().size()];
  sets.push_back({"dead among live", mixed});
  sets.push_back({"primary", morton_primary(bvh.bounds)});
  if (triangles.empty() || bvh.nodes.empty()) return sets;
  sets.push_back({"axis-parallel", axis_rays(triangles, 777)});
  sets.push_back({"on box faces", on_box_faces(bvh, 777)});
  sets.push_back({"on triangles", on_triangles(triangles, 777)});
  sets.push_back({"grazing", grazing(triangles, 555)});
  sets.push_back({"edges and vertices", edge_rays(triangles, 777, {0.1f, 0.2f, 1.9f})});
  return sets;
}

}  // namespace ballot::shapes
