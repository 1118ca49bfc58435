// The oracle's arithmetic: one ray against triangles and boxes in double precision. Internal to the oracle.
//
// Woop, Benthin, Wald. Watertight Ray/Triangle Intersection. JCGT 2(1), 2013: the ray is sheared onto the z axis, and
// the signs of the edge functions of the projected triangle decide. An edge function depends on its two vertices alone
// and only changes its sign with their order, so neighbours agree on a shared edge.
#pragma once

#include <optional>
#include <vector>

#include "engine/bvh/device_decode.h"
#include "engine/bvh/oracle.h"

namespace ballot {

struct RayFrame {
  explicit RayFrame(const Ray& ray, const Bounds& bounds);
  double o[3], d[3], inverse_d[3];
  int kx, ky, kz;  // kz: the axis along which the ray is steepest
  double sx, sy, sz;
  double t_min, t_max;
  double pad[3];                             // by which boxes are widened, scene units
  Arithmetic arithmetic = Arithmetic::Woop;  // whose rounding is judged
};

/// A triangle as the ray sees it. Sides are twice the areas that the ray's point spans with each edge.
struct Sight {
  Sight(const RayFrame& ray, const Triangle& triangle);
  double x[3], y[3];  // lateral position of the vertices, scene units
  double z[3];        // depth of the vertices, in multiples of the ray's direction, as t
  double side[3];     // edge function opposite to each vertex: U, V, W
  double det;         // their sum
  double reach;       // largest distance of a vertex from the origin along an axis, scene units

  double t() const { return (side[0] * z[0] + side[1] * z[1] + side[2] * z[2]) / det; }
  double weight(int vertex) const { return side[vertex] / det; }
};

/// The hit of the triangle's double precision image, edges included, or nothing.
std::optional<OracleHit> intersect(const RayFrame& ray, const Triangle& triangle, std::uint32_t prim);

/// Where the ray enters the widened box, if it does so for some t in [ray.t_min, t_far].
std::optional<double> enter(const RayFrame& ray, const Bounds& box, double t_far);

/// Calls visit(texel of a triangle) for every triangle of every leaf whose widened box the ray meets in
/// [ray.t_min, t_far], near boxes first; visit may lower t_far. Ends when visit returns false.
template <class Visit>
void walk(const DeviceBvh& bvh, const RayFrame& ray, const double& t_far, const Visit& visit) {
  struct Entry {
    std::uint32_t ref;
    double near;
  };
  if (bvh.root == END_OF_TREE) return;
  std::vector<Entry> stack;
  stack.reserve(bvh.depth + 2);
  stack.push_back({bvh.root, ray.t_min});
  while (!stack.empty()) {
    const Entry entry = stack.back();
    stack.pop_back();
    if (entry.near > t_far) continue;
    if (is_leaf(entry.ref)) {
      std::uint32_t texel = leaf_texel(entry.ref) + LEAF_HEADER_TEXELS;
      for (std::uint32_t i = 0; i < leaf_count(entry.ref); ++i, texel += TRIANGLE_TEXELS)
        if (!visit(texel)) return;
      continue;
    }
    const DevicePair pair = decode_pair_from_zero(bvh, entry.ref);
    const std::optional<double> left = enter(ray, pair.left.box, t_far);
    const std::optional<double> right = enter(ray, pair.right.box, t_far);
    const bool right_first = left && right && *right < *left;
    if (left && right_first) stack.push_back({pair.left.ref, *left});
    if (right) stack.push_back({pair.right.ref, *right});
    if (left && !right_first) stack.push_back({pair.left.ref, *left});
  }
}

/// Calls visit(texel of a triangle) for all triangles of all leaf blocks, in order.
template <class Visit>
void for_all_triangles(const DeviceBvh& bvh, const Visit& visit) {
  for (std::uint32_t block = 0; block < bvh.leaves.size();) {
    const std::uint32_t count = bvh.leaves[block].w;
    block += LEAF_HEADER_TEXELS;
    for (std::uint32_t i = 0; i < count; ++i, block += TRIANGLE_TEXELS) visit(block);
  }
}

}  // namespace ballot
