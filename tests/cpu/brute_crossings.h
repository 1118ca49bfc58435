// The exact crossings of a ray by brute force, which tests of oracles and of devices compare with.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "engine/oracle/nearest.h"
#include "engine/oracle/oracle.h"
#include "engine/tree/host/forest.h"
#include "tests/cpu/shapes.h"

namespace ballot {

/// Returns the exact crossings of a ray, in order. way: -1 those from the front alone, 1 those from the back, 0 all.
inline std::vector<std::uint32_t> crossings_of(const Ray& ray, std::span<const Triangle> triangles, int way = 0) {
  std::vector<std::pair<ExactSight, std::uint32_t>> found;
  for (std::uint32_t i = 0; i < triangles.size(); ++i) {
    const ExactSight sight(ray, triangles[i]);
    if (!exact_crosses(ray, triangles[i], sight) || !sight.within(ray)) continue;
    if (way == 0 || sight.det.sign() == way) found.emplace_back(sight, i);
  }
  std::ranges::stable_sort(found, [](const auto& a, const auto& b) { return compare_t(a.first, b.first) < 0; });
  std::vector<std::uint32_t> prims;
  for (const auto& [sight, prim] : found) prims.push_back(prim);
  return prims;
}

/// The same for instances: of each the exact crossings of its object-space ray, in order of t in float32, at equal t of
/// the number. `way` is that of the moved triangles.
inline std::vector<std::uint32_t> crossings_of(const Ray& ray, const Forest& forest, int way = 0) {
  std::vector<std::pair<float, std::uint32_t>> found;
  if (is_dead(ray)) return {};
  for (const Instance& i : forest.instances()) {
    const std::span<const Triangle> mesh = forest.meshes()[i.mesh].triangles;
    const Ray object = object_ray(ray, i.map);
    float last = -std::numeric_limits<float>::infinity();  // rounding must not turn the exact order round
    for (const std::uint32_t prim : crossings_of(object, mesh, i.mirrors ? -way : way)) {
      last = std::max(last, float(ExactSight(object, mesh[prim]).t() * double(direction_scale(ray))));
      found.emplace_back(last, i.first + prim);
    }
  }
  std::ranges::stable_sort(found, {}, &std::pair<float, std::uint32_t>::first);
  std::vector<std::uint32_t> prims;
  for (const auto& [t, prim] : found) prims.push_back(prim);
  return prims;
}

}  // namespace ballot
