// The exact crossings of a ray by brute force, which tests of oracles and of devices compare with.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "engine/oracle/nearest.h"
#include "tests/cpu/shapes.h"

namespace ballot {

/// Returns the exact crossings of a ray, in order. way: -1 those from the front alone, 1 those from the back, 0 all.
inline std::vector<std::uint32_t> crossings_of(const Ray& ray, const shapes::Triangles& triangles, int way = 0) {
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

}  // namespace ballot
