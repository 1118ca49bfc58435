// The walk of the oracles over the instances of a forest. Internal to engine/oracle.
#pragma once

#include <algorithm>
#include <cmath>

#include "engine/bvh/forest.h"

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

/// Returns the nearest hit of a ray: of each instance's object-space ray by the oracle of its mesh, and among instances
/// that of the smallest t; at equal t of the first instance. t counts multiples of the ray's direction, and prim is
/// counted through the instances.
template <class HitOf, class Oracles>
HitOf nearest_of_instances(const Forest& forest, const Oracles& of_meshes, const Ray& ray) {
  HitOf best;
  if (is_dead(ray)) return best;
  for (const Instance& i : forest.instances()) {
    if (surely_misses(i, forest.meshes()[i.mesh].extents, ray)) continue;
    HitOf hit = of_meshes[i.mesh].nearest(object_ray(ray, i.map));
    if (hit.prim == NO_HIT) continue;
    hit.t *= double(direction_scale(ray));
    hit.prim += i.first;
    if (best.prim == NO_HIT || hit.t < best.t) best = hit;
  }
  return best;
}

}  // namespace ballot
