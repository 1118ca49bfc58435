// Named scenes, and rays and points about them, on which methods, walks of the host and kernels of users are held to
// what is true.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <ostream>

#include "shaders/shared/query.h"
#include "tests/device/ray_sets.h"

namespace ballot::scene_cases {

struct SceneCase {
  const char* name;
  shapes::Triangles (*make)();
  bool own_kernels = false;  // kernels are compiled for its tree alone
};

inline void PrintTo(const SceneCase& scene, std::ostream* out) { *out << scene.name; }

inline const SceneCase kScenes[] = {
    {"none", [] { return shapes::Triangles{}; }},
    {"one", [] { return shapes::soup(1, 1); }, true},
    {"six", [] { return shapes::soup(6, 1); }},
    {"seven", [] { return shapes::soup(7, 1); }},
    {"identical", [] { return shapes::identical(100); }},
    {"coplanar", [] { return shapes::coplanar(200); }},
    {"soup", [] { return shapes::soup(3000, 0.1f); }},
    {"sphere", [] { return shapes::sphere(5); }, true},
    {"slivers", [] { return shapes::slivers(150); }},
    {"hugeAndTiny", [] { return shapes::huge_and_tiny(400); }},
    {"sameCentroid", [] { return shapes::same_centroid(120); }},
};

inline const SceneCase kFarSmallLarge[] = {
    {"far",
     [] {
       return shapes::moved(shapes::sphere(4), {3000, -200, 1e5f});
     }},
    {"small", [] { return shapes::scaled(shapes::sphere(4), 1e-30f); }},
    {"large", [] { return shapes::scaled(shapes::soup(500, 0.3f), 1e10f); }},
};

/// Returns rays as they are, moved and scaled along with the triangles of a scene.
inline std::vector<Ray> rays_about(const shapes::Triangles& triangles, const Bvh& bvh) {
  std::vector<Ray> all;
  for (const shapes::RaySet& set : shapes::ray_sets(triangles, bvh)) {
    all.insert(all.end(), set.rays.begin(), set.rays.end());
    const glm::vec3 middle = 0.5f * (bvh.bounds.lo + bvh.bounds.hi), half = 0.5f * (bvh.bounds.hi - bvh.bounds.lo);
    const float size = std::max({half.x, half.y, half.z});
    for (Ray ray : set.rays) {
      ray.origin = middle + size * ray.origin;
      ray.dir *= size;
      all.push_back(ray);
    }
  }
  for (Ray ray : shapes::random_rays(300, 5)) {  // from far away, with parts of the direction that vanish
    ray.origin = ray.origin * 1e6f;
    all.push_back(shapes::towards(ray.origin, 0.5f * (bvh.bounds.lo + bvh.bounds.hi)));
    ray.dir.y *= 1e-40f;
    all.push_back(ray);
  }
  return all;
}

/// Returns points in and about a scene, far from it, and on, by and at the corners of its triangles, some with limits.
inline std::vector<ProbePoint> probes_about(const shapes::Triangles& triangles, const Bounds& b) {
  shapes::Random random(3);
  const glm::vec3 middle = 0.5f * (b.lo + b.hi), half = 0.5f * (b.hi - b.lo);
  const float size = std::max({half.x, half.y, half.z, 1e-36f}), none = std::numeric_limits<float>::infinity();
  std::vector<ProbePoint> points{{{NAN, 0, 0}, none}, {{0, none, 0}, none}, {middle, 0}, {middle, -1}, {middle, NAN}};
  for (std::size_t i = 0; i < 400; ++i) {
    points.push_back({middle + random.point(1.5f * size), i % 3 ? none : size * random.in(0, 1)});
    points.push_back({middle + random.point(1000 * size), none});  // far
    if (triangles.empty()) continue;
    const Triangle& t = triangles[random.below(triangles.size())];
    const float s = random.in(0, 1), r = random.in(0, 1) * (1 - s);
    points.push_back({t[random.below(3)], none});
    points.push_back({(t[0] + t[1]) * 0.5f, none});
    points.push_back({t[0] * (1 - s - r) + t[1] * s + t[2] * r, 1e-3f * size});
    points.push_back({t[0] * (1 - s - r) + t[1] * s + t[2] * r + random.point(1e-4f * size), none});
  }
  return points;
}

}  // namespace ballot::scene_cases
