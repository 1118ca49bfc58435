#include "engine/answer/host_walk.h"

#include <algorithm>

#include "engine/answer/host_arithmetic.h"
#include "engine/answer/variant.h"
#include "engine/core/interruption.h"

namespace ballot {

using namespace host_arithmetic;

std::optional<HostWalk> HostWalk::over(Context& gpu, DeviceTree& tree, Of what, std::optional<NodeLayout> layout) {
  if (!gpu.answers_few() || gpu.info().known_driver() != Driver::Llvmpipe || tree.forest()) return {};
  const KernelConfig config =
      kernel_config_for(find_method("while-while"), find_numeric(kDefaultNumeric), gpu.info(), {});
  if (config.products != Products::Float64 || config.padding != Padding::Ray || tree.facts().depth >= kMostDepth)
    return {};
  TreeReads reads{.access = config.tree_access()};
  reads.access.layout = layout.value_or(config.layout);
  reads.access.fetch = tree.fitting_fetch(config.fetch);
  if (reads.access.layout != NodeLayout::Interleaved && reads.access.layout != NodeLayout::Compact) return {};
  if (what == Of::Rays || !config.loops_cut) reads.source = tree.source_of(reads.format, reads.leaves);
  if (!tree.has_pairs(reads.access, reads.source) || gpu.has_recorded() || gpu.in_flight() > 0) ask_interruption();
  const KernelArrays arrays(tree, reads);
  gpu.finish();
  const std::byte *nodes = arrays.nodes->mapped(), *leaves = arrays.leaves->mapped();
  if (!nodes || !leaves) return {};
  HostWalk walk;
  walk.nodes_ = reinterpret_cast<const glm::uvec4*>(nodes);
  walk.leaves_ = reinterpret_cast<const glm::uvec4*>(leaves);
  walk.layout_ = reads.access.layout;
  walk.root_ = tree.root();
  walk.scene_ = tree.bvh().bounds;
  walk.box_origin_ = tree.box_origin();
  walk.shear_scale_ = tree.shear().scale;
  walk.shear_near_ = tree.shear().near;
  return walk;
}

namespace {

constexpr float kLargest = 3.4e38f;

/// lib/numeric/ray_scale.glsl
std::uint32_t direction_exponent(const vec3& d) { return std::min(bits_of(largest(glm::abs(d))) >> 23, 253u); }
float scaled_component(float d, std::uint32_t exponent) {
  const std::uint32_t bits = bits_of(d);
  if (bits & 0x7F800000u) return d * float_of((254 - exponent) << 23);
  const float rest = float_of((128 - std::min(exponent, 128u)) << 23);
  return float_of(bits_of(float(bits & 0x7FFFFFu) * 0x1p-23f * rest) | (bits & 0x80000000u));
}

/// lib/tree/leaf.glsl
bool is_dead(const Ray& r) {
  const bool finite = is_finite(r.origin) && is_finite(r.dir) && is_finite(r.t_min) && is_finite(r.t_max);
  return !finite || !(r.t_max > r.t_min) || largest(glm::abs(r.dir)) < 0x1p-126f;
}

/// lib/numeric/box.glsl
float reciprocal(float d) { return 1 / (std::abs(d) < 0x1p-60f ? (d < 0 ? -0x1p-60f : 0x1p-60f) : d); }

/// A ray on its walk, scaled, with its nearest hit so far: lib/tree/leaf.glsl, lib/numeric/triangle_watertight.glsl.
struct Walker {
  int m, m1, m2;  // its main axis, and those that follow in a circle
  vec3 origin;    // o[m1] and o[m2], scaled, and o[m]
  float scale, inv, first, second;
  float t_min;
  Hit hit;

  void meet(const glm::uvec4* triangle) {
    const vec3 p = vec3_of(triangle[m1]), q = vec3_of(triangle[m2]), z = vec3_of(triangle[m]) - origin.z;
    const vec3 x = first * z + (p * scale - origin.x), y = second * z + (q * scale - origin.y);
    const float e0 = difference_of_products(x.z, y.y, y.z, x.y), e1 = difference_of_products(x.x, y.z, y.x, x.z),
                e2 = difference_of_products(x.y, y.x, y.y, x.x);
    if (!(smaller(smaller(e0, e1), e2) >= 0 || larger(larger(e0, e1), e2) <= 0)) return;
    const float det = e0 + e1 + e2, inverse = 1 / det, u = e1 * inverse, v = e2 * inverse;
    const float t = (v * z.z + (u * z.y + e0 * inverse * z.x)) * inv;
    const std::uint32_t prim = triangle[m].w;
    if (det != 0 && t >= t_min && t <= hit.t && (t < hit.t || prim < hit.prim)) hit = {t, prim, u, v};
  }
};

/// Returns the bounds of a box by centre and half extents. They are off by 2^-24 of themselves.
Bounds bounds_of_centred(const Bounds& box) { return {box.lo - box.hi, box.lo + box.hi}; }

/// The boxes of a ray: lib/numeric/box_padded.glsl. As hits do not depend on them, there is one form for both layouts:
/// planes are padded as for boxes by centre and half extents, and by 4 w |o|, which covers bounds_of_centred() too.
struct Slabs {
  vec3 lo_origin, hi_origin, inv;

  /// Returns whether the ray meets the box before `t_max`, and `near`, t at the entry.
  bool meets(const Bounds& box, float t_min, float t_max, float& near) const {
    const vec3 a = (box.lo - lo_origin) * inv, b = (box.hi - hi_origin) * inv;
    near = larger(larger(smaller(a.x, b.x), smaller(a.y, b.y)), larger(smaller(a.z, b.z), t_min));
    return near <= smaller(smaller(larger(a.x, b.x), larger(a.y, b.y)), smaller(larger(a.z, b.z), t_max));
  }
};

}  // namespace

Hit HostWalk::trace(const Ray& given, Want want) const {
  const Hit miss{kInfinity, NO_HIT, 0, 0};
  if (is_dead(given)) return miss;
  const std::uint32_t exponent = direction_exponent(given.dir);
  const float to_walk = float_of(exponent << 23);
  vec3 dir, inverse;
  for (int k = 0; k < 3; ++k) dir[k] = scaled_component(given.dir[k], exponent), inverse[k] = reciprocal(dir[k]);
  const vec3 o = given.origin, a = glm::abs(dir), from = o - box_origin_;

  Walker w;
  w.m = a.x >= a.y && a.x >= a.z ? 0 : a.y >= a.z ? 1 : 2;
  w.m1 = (w.m + 1) % 3, w.m2 = (w.m + 2) % 3;
  w.t_min = std::clamp(given.t_min * to_walk, -kLargest, kLargest);
  w.hit = {std::clamp(given.t_max * to_walk, -kLargest, kLargest), NO_HIT, 0, 0};
  const float reach = largest(glm::abs(from));
  w.scale = reach <= shear_near_ ? shear_scale_ : float_of((314 - (bits_of(reach) >> 23)) << 23);
  w.inv = inverse[w.m];
  w.first = -dir[w.m1] * (w.inv * w.scale), w.second = -dir[w.m2] * (w.inv * w.scale);
  w.origin = {o[w.m1] * w.scale, o[w.m2] * w.scale, o[w.m]};

  const float pad = 3.82e-6f * scene_reach(scene_.lo, scene_.hi, o);
  const vec3 e = vec3(pad) + 2.5e-7f * glm::abs(from);
  const Slabs slabs{from + e, from - e, inverse};
  const bool compact = layout_ == NodeLayout::Compact;
  WalkWatch watch;
  Todo stack[kMostDepth + 1];
  std::size_t top = 0;
  std::uint32_t node = root_;
  while (node != END_OF_TREE) {
    if (is_leaf(node)) {
      watch.visit_leaf();
      const glm::uvec4* triangle = leaves_ + leaf_texel(node) + LEAF_HEADER_TEXELS;
      for (std::uint32_t i = 0; i < leaf_count(node); ++i) w.meet(triangle + i * TRIANGLE_TEXELS);
      if (want == Want::Any && w.hit.prim != NO_HIT) break;
    } else {
      Children c = compact ? centred_children(nodes_ + node) : children(nodes_ + node);
      if (compact) c.l = bounds_of_centred(c.l), c.r = bounds_of_centred(c.r);
      // Without branches that the processor would have to guess.
      float near_l, near_r;
      const bool l = slabs.meets(c.l, w.t_min, w.hit.t, near_l), r = slabs.meets(c.r, w.t_min, w.hit.t, near_r);
      const bool right_first = r & (!l | (near_r < near_l));
      stack[top] = right_first ? Todo{c.left, near_l} : Todo{c.right, near_r};
      top += std::size_t(l & r);
      if (l | r) {
        node = right_first ? c.right : c.left;
        continue;
      }
    }
    while (top > 0 && stack[top - 1].near > w.hit.t) --top;
    node = top > 0 ? stack[--top].node : END_OF_TREE;
  }
  if (w.hit.prim == NO_HIT) return miss;
  return {w.hit.t * float_of((254 - exponent) << 23), w.hit.prim, w.hit.u, w.hit.v};
}

}  // namespace ballot
