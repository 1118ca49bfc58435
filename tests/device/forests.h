// Scenes of instances, and rays for them, that the device tests trace.
#pragma once

#include <cmath>

#include "tests/device/harness.h"
#include "tests/device/ray_sets.h"

namespace ballot::forests {

inline Transform transform(const glm::vec3& x, const glm::vec3& y, const glm::vec3& z, const glm::vec3& at) {
  Transform t;
  for (int r = 0; r < 3; ++r) t.m[r][0] = x[r], t.m[r][1] = y[r], t.m[r][2] = z[r], t.m[r][3] = at[r];
  return t;
}
inline Transform moved(const glm::vec3& by) { return transform({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, by); }

/// A turn about y, then a turn about x, with scales of the mesh's axes.
inline Transform turned(float a, float b, const glm::vec3& scale, const glm::vec3& at) {
  const float c = std::cos(a), s = std::sin(a), d = std::cos(b), e = std::sin(b);
  return transform(glm::vec3(c, -s * -e, -s * d) * scale.x, glm::vec3(0, d, e) * scale.y,
                   glm::vec3(s, c * -e, c * d) * scale.z, at);
}

inline std::vector<UnsetVector<Triangle>> three_meshes() {
  return {shapes::sphere(3), shapes::soup(700, 0.2f), {}, shapes::grid(9), shapes::soup(1, 1)};
}

/// Rotations, mirrors, unequal scales, one inside another, and copies that share faces or lie on each other.
inline std::vector<Placement> twelve_instances() {
  return {{0, moved({0, 0, 0})},
          {0, turned(0.3f, 0.7f, {0.5f, 0.5f, 0.5f}, {0.1f, 0, 0})},
          {0, turned(1, 2, {1.5f, 0.2f, -0.8f}, {-1, 0.5f, 0})},
          {1, turned(2, 0.4f, {-1, 1, 1}, {1.5f, 0, 0.5f})},
          {1, moved({1.5f, 0, 0.5f})},
          {2, moved({0, 0, 0})},
          {3, moved({-2, -1, 0})},
          {3, moved({0, -1, 0})},                     // shares an edge with the one before
          {3, turned(0, 0, {1, 1, -1}, {0, -1, 0})},  // the same height field, mirrored
          {0, moved({0, 0, 0})},                      // lies on the first
          {4, turned(0.5f, 0.5f, {3, 3, 1e-3f}, {0, 1, 0})},
          {1, turned(0.1f, 3, {1e-2f, 1e-2f, 1e-2f}, {0.5f, 1, 1})}};
}

inline BuildSettings quick() { return {.builder = BuilderId::Balanced}; }

inline Forest make_forest(std::vector<UnsetVector<Triangle>> meshes, std::span<const Placement> placements) {
  return Forest(std::move(meshes), placements, [](std::span<const Triangle> t) { return build_bvh(t, quick()); });
}

inline std::vector<Ray> rays_for(const Forest& forest, std::size_t count) {
  std::vector<Ray> rays = shapes::random_rays(count);
  for (Ray& r : rays) r.dir *= 0.25f + 8 * std::abs(r.origin.x);  // of many lengths
  for (const Ray& r : shapes::morton_primary(forest.top_facts().bounds))
    if (rays.size() < 2 * count) rays.push_back(r);
  for (const Ray& r : shapes::axis_rays(shapes::grid(9), count / 4)) rays.push_back(r);
  rays.push_back({{0, 0, 0}, 0, {0, 0, 0}, 1});
  rays.push_back({{0, 0, 0}, 1, {0, 0, 1}, 0});
  rays.push_back({{NAN, 0, 0}, 0, {0, 0, 1}, 1});
  rays.push_back({{1e30f, 0, 0}, 0, {-1, 0, 0}, 3e38f});
  rays.push_back({{0, 0, 0}, -5, {0, 0, 1e-30f}, 3e38f});
  rays.push_back({{0, 0, 0}, -5, {0, 1e30f, 1}, 3e38f});
  return rays;
}

/// Every method that has kernels for instances, with one vote each.
inline std::vector<Query> every_instance_method(Want want, std::string_view numeric) {
  std::vector<Query> queries;
  for (const Method& m : kMethods)
    if (m.instances) queries.push_back({want, std::string(m.name), std::string(numeric), harness::votes_of(m).back()});
  return queries;
}

/// Returns true on GPUs and, of lavapipe's drivers and sizes, on one: for what takes it long and depends on neither.
inline bool is_first(const DeviceInfo& d) { return !d.is_cpu() || (d.subgroup_size == 8 && d.mesa_version() < 250000); }

}  // namespace ballot::forests
