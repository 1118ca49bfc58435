// Points by walks of the host: the nearest point of shaders/query/closest_point.comp and the parity of
// shaders/query/inside.comp, whose names these are and which have the proofs. Also the order of the walk to the nearest
// point is the kernel's, as the answers to far points depend on it.
#include <algorithm>
#include <cmath>
#include <glm/vec2.hpp>

#include "engine/answer/host_arithmetic.h"
#include "engine/answer/host_walk.h"

namespace ballot {

using namespace host_arithmetic;

namespace {

constexpr float kFarthest = std::numeric_limits<float>::max();
constexpr float kPointPad = 7.6294e-6f;
constexpr float kLeastNormal = 3.155444e-30f, kLeastEdge2 = 1.972152e-31f, kUnderflow = 7.888609e-31f;

float dot_of(const vec3& a, const vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
float square(const vec3& v) { return dot_of(v, v); }
vec3 cross_of(const vec3& a, const vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// lib/query/frame.glsl
float scale_for(float magnitude, std::uint32_t bits) {
  return float_of(std::min(254 + bits - std::clamp(bits_of(magnitude) >> 23, 1u, 253u), 253u) << 23);
}

struct Probe {
  vec3 at, from, scaled;
  float scale, pad;
  bool far;

  Probe(const vec3& point, const Bounds& scene, const vec3& box_origin) : at(point), from(point - box_origin) {
    const float reach = scene_reach(scene.lo, scene.hi, at);
    scale = scale_for(reach, 38);
    scaled = at * scale;
    far = reach > 16 * largest(scene.hi - scene.lo);
    pad = far ? 0 : kPointPad * reach;
  }

  /// Returns the squared distance, scaled, of a child's box.
  float distance2(const Bounds& box, bool centred) const {
    vec3 d;
    for (int k = 0; k < 3; ++k)
      d[k] = (centred ? larger(std::abs(box.lo[k] - from[k]) - (box.hi[k] + pad), 0)
                      : larger(larger(box.lo[k] - (from[k] + pad), (from[k] - pad) - box.hi[k]), 0)) *
             scale;
    return square(d);
  }
  /// Returns true if the ray along +x may meet a child's box.
  bool may_meet(const Bounds& box, bool centred) const {
    for (const int k : {1, 2}) {
      const float outside = centred ? std::abs(box.lo[k] - from[k]) - (box.hi[k] + pad)
                                    : larger(box.lo[k] - (from[k] + pad), (from[k] - pad) - box.hi[k]);
      if (!(outside <= 0)) return false;
    }
    return centred ? box.lo.x + (box.hi.x + pad) >= from.x - pad : box.hi.x >= from.x - 2 * pad;
  }
  float reach_of(float d2) const { return far ? float_of(bits_of(d2) - 1) : d2; }
};

struct Side {
  float at_p, at_q;
  vec3 foot;
  bool between;
};

Side side_of(const vec3& p, const vec3& q, const vec3& e) {
  const float at_p = -dot_of(p, e), at_q = dot_of(q, e), length2 = at_p + at_q, inverse = 1 / length2;
  return {at_p, at_q, p * (at_q * inverse) + q * (at_p * inverse), at_p > 0 && at_q > 0 && length2 > kLeastEdge2};
}

struct Around {
  vec3 a, b, c, ab, bc, ca;
};

Around around(const Probe& p, const glm::uvec4* triangle) {
  const Triangle t = decode_triangle(triangle);
  const vec3 a = t[0] * p.scale, b = t[1] * p.scale, c = t[2] * p.scale;
  return {a - p.scaled, b - p.scaled, c - p.scaled, b - a, c - b, a - c};
}

struct Near {
  float distance2;
  Side ab, bc, ca;
  vec3 normal;
  float depth, normal2, plane;
  vec3 sides;
  bool inside;
};

Near nearest_of(const Around& t) {
  Near n;
  n.ab = side_of(t.a, t.b, t.ab), n.bc = side_of(t.b, t.c, t.bc), n.ca = side_of(t.c, t.a, t.ca);
  n.normal = {difference_of_products(t.ab.y, t.bc.z, t.ab.z, t.bc.y),
              difference_of_products(t.ab.z, t.bc.x, t.ab.x, t.bc.z),
              difference_of_products(t.ab.x, t.bc.y, t.ab.y, t.bc.x)};
  const float size = largest(glm::abs(n.normal));
  n.normal *= size > kLeastNormal ? scale_for(size, 0) : 0.0f;
  n.normal2 = square(n.normal);
  n.depth = dot_of(n.normal, t.a);
  n.sides = {dot_of(cross_of(n.normal, t.bc), t.b), dot_of(cross_of(n.normal, t.ca), t.c),
             dot_of(cross_of(n.normal, t.ab), t.a)};
  const float ab = n.ab.at_p + n.ab.at_q, bc = n.bc.at_p + n.bc.at_q, ca = n.ca.at_p + n.ca.at_q;
  const bool beside = ab >= bc && ab >= ca ? n.ab.between : bc >= ca ? n.bc.between : n.ca.between;
  n.inside = beside && n.normal2 > 0 && larger(larger(n.sides.x, n.sides.y), n.sides.z) <= 0;
  float best = smaller(square(t.a), smaller(square(t.b), square(t.c)));
  for (const Side* side : {&n.ab, &n.bc, &n.ca}) best = smaller(best, side->between ? square(side->foot) : kFarthest);
  n.plane = n.depth * n.depth / n.normal2;
  n.distance2 = smaller(best, n.inside ? n.plane : kFarthest);
  return n;
}

struct Foot {
  vec3 at, weights;
  std::uint32_t part;
};

Foot foot_of(const Around& t, const Near& n) {
  const float d = n.distance2;
  Foot f{t.a, {1, 0, 0}, 0};
  if (square(t.b) == d) f = {t.b, {0, 1, 0}, 1};
  if (square(t.c) == d) f = {t.c, {0, 0, 1}, 2};
  if (n.ab.between && square(n.ab.foot) == d) f = {n.ab.foot, {n.ab.at_q, n.ab.at_p, 0}, PART_EDGE};
  if (n.bc.between && square(n.bc.foot) == d) f = {n.bc.foot, {0, n.bc.at_q, n.bc.at_p}, PART_EDGE + 1};
  if (n.ca.between && square(n.ca.foot) == d) f = {n.ca.foot, {n.ca.at_p, 0, n.ca.at_q}, PART_EDGE + 2};
  if (n.inside && n.plane == d) f = {n.normal * (n.depth / n.normal2), -n.sides, PART_INSIDE};
  f.weights /= f.weights.x + f.weights.y + f.weights.z;
  return f;
}

bool is_behind(const Near& n, const Foot& f, const vec3* pseudonormals) {
  return f.part == PART_INSIDE ? n.depth > 0 : dot_of(pseudonormals[f.part], f.at) > 0;
}

/// lib/query/crossing.glsl
float side_value(const glm::vec2& p, const glm::vec2& q) { return difference_of_products(q.x, p.y, q.y, p.x); }
int side_sign(float side, const glm::vec2& p, const glm::vec2& q) {
  if (side != 0) return side > 0 ? 1 : -1;
  if (p.y != q.y) return q.y > p.y ? 1 : -1;
  return p.x > q.x ? 1 : p.x < q.x ? -1 : 0;
}

/// Returns true if the ray along +x crosses the triangle.
bool crosses(const Probe& p, const glm::uvec4* triangle) {
  const Triangle t = decode_triangle(triangle);
  const vec3 v0 = t[0] * p.scale - p.scaled, v1 = t[1] * p.scale - p.scaled, v2 = t[2] * p.scale - p.scaled;
  const glm::vec2 a{v0.y, v0.z}, b{v1.y, v1.z}, c{v2.y, v2.z};
  const float e0 = side_value(b, c), e1 = side_value(c, a), e2 = side_value(a, b);
  float x = e0 * v0.x + e1 * v1.x + e2 * v2.x;
  if (std::abs(x) < kUnderflow) {
    const float scale = scale_for(larger(larger(std::abs(e0), std::abs(e1)), std::abs(e2)), 0);
    x = e0 * scale * v0.x + e1 * scale * v1.x + e2 * scale * v2.x;
  }
  const int s0 = side_sign(e0, b, c), s1 = side_sign(e1, c, a), s2 = side_sign(e2, a, b);
  return s0 != 0 && s0 == s1 && s1 == s2 && (s0 > 0 ? x > 0 : x < 0);
}

/// The bits, as a negative denormal limit is none.
bool is_limit(float limit) { return bits_of(limit) <= 0x7F800000u || bits_of(limit) == 0x80000000u; }

}  // namespace

Nearest HostWalk::nearest(const ProbePoint& point, std::span<const glm::vec3> pseudonormals) const {
  const Nearest none{{0, 0, 0}, kInfinity, NO_HIT, 0, 0, 0};
  if (!is_finite(point.at) || !is_limit(point.limit)) return none;
  const bool compact = layout_ == NodeLayout::Compact;
  const Probe p(point.at, scene_, box_origin_);
  const float limit = point.limit * p.scale;
  float best2 = smaller(limit * limit * 1.000001f, kFarthest), reach2 = best2;
  std::uint32_t prim = NO_HIT;
  const glm::uvec4* found = nullptr;
  WalkWatch watch;
  Todo stack[kMostDepth + 1];
  std::size_t top = 0;
  stack[top++] = {END_OF_TREE, -1};
  const auto pop = [&] {
    do --top;
    while (stack[top].near > reach2);
    return stack[top].node;
  };
  for (std::uint32_t node = root_; node != END_OF_TREE;) {
    if (!is_leaf(node)) {
      const Children c = compact ? centred_children(nodes_ + node) : children(nodes_ + node);
      const float l = p.distance2(c.l, compact), r = p.distance2(c.r, compact);
      const bool right_first = r < l;
      const float near = smaller(l, r), next = larger(l, r);
      if (next <= reach2) stack[top++] = {right_first ? c.left : c.right, next};
      node = right_first ? c.right : c.left;
      if (!(near <= reach2)) node = pop();
      continue;
    }
    watch.visit_leaf();
    const glm::uvec4* triangle = leaves_ + leaf_texel(node) + LEAF_HEADER_TEXELS;
    for (std::uint32_t i = 0; i < leaf_count(node); ++i, triangle += TRIANGLE_TEXELS) {
      const float d = nearest_of(around(p, triangle)).distance2;
      if (!(d < best2 || (d == best2 && triangle->w < prim))) continue;
      best2 = d, reach2 = p.reach_of(d), prim = triangle->w, found = triangle;
    }
    node = pop();
  }
  if (!found) return none;
  const Around t = around(p, found);
  const Near n = nearest_of(t);
  const Foot f = foot_of(t, n);
  const float inverse = 1 / p.scale, distance = std::sqrt(n.distance2) * inverse;
  if (!(distance <= point.limit)) return none;
  const bool behind = !pseudonormals.empty() && is_behind(n, f, &pseudonormals[PSEUDONORMALS * std::size_t(prim)]);
  return {p.at + f.at * inverse, distance, prim, f.weights.y, f.weights.z, behind};
}

bool HostWalk::inside(const vec3& point) const {
  if (!is_finite(point)) return false;
  const Probe p(point, scene_, box_origin_);
  if (p.far) return false;
  const bool compact = layout_ == NodeLayout::Compact;
  bool odd = false;
  WalkWatch watch;
  std::uint32_t stack[kMostDepth + 1];
  std::size_t top = 0;
  stack[top++] = END_OF_TREE;
  for (std::uint32_t node = root_; node != END_OF_TREE;) {
    if (!is_leaf(node)) {
      const Children c = compact ? centred_children(nodes_ + node) : children(nodes_ + node);
      const bool l = p.may_meet(c.l, compact), r = p.may_meet(c.r, compact);
      if (l && r) stack[top++] = c.right;
      node = l ? c.left : r ? c.right : stack[--top];
      continue;
    }
    watch.visit_leaf();
    const glm::uvec4* triangle = leaves_ + leaf_texel(node) + LEAF_HEADER_TEXELS;
    for (std::uint32_t i = 0; i < leaf_count(node); ++i) odd ^= crosses(p, triangle + i * TRIANGLE_TEXELS);
    node = stack[--top];
  }
  return odd;
}

}  // namespace ballot
