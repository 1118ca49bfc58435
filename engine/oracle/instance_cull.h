// Leaves out instances that a ray surely misses, so that oracles need not try them all. Internal to engine/oracle.
#pragma once

#include <algorithm>
#include <cmath>

#include "engine/bvh/instance.h"

namespace ballot {

/// Returns true if the ray misses the instance's box, widened 16 times as far as the proof of that box asks, and by a
/// 1000th of its size: the oracles shall find the errors of that proof, should there be some.
inline bool surely_misses(const Instance& instance, const MeshExtents& mesh, const Ray& ray) {
  if (mesh.empty) return true;
  const Bounds& b = instance.box;
  double far = 0, size = 0;
  for (int k = 0; k < 3; ++k) {
    const double o = ray.origin[k];
    far = std::max({far, std::abs(double(b.lo[k]) - o), std::abs(double(b.hi[k]) - o)});
    size = std::max(size, double(b.hi[k]) - double(b.lo[k]));
  }
  const double pad = 16 * double(instance.slack) * far + size / 1024;
  double near = -INFINITY, beyond = INFINITY;
  for (int k = 0; k < 3; ++k) {
    const double lo = double(b.lo[k]) - ray.origin[k] - pad, hi = double(b.hi[k]) - ray.origin[k] + pad;
    const double d = ray.dir[k];
    if (std::abs(d) < 1e-200) {
      if (lo > 0 || hi < 0) return true;
      continue;
    }
    near = std::max(near, std::min(lo / d, hi / d));
    beyond = std::min(beyond, std::max(lo / d, hi / d));
  }
  return near > beyond || beyond < ray.t_min || near > ray.t_max;
}

}  // namespace ballot
