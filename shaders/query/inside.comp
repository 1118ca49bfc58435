#version 460
#extension GL_GOOGLE_include_directive : require
// Inside test: for each point, whether a ray from it along +x crosses the surface an odd number of times. A walk of the
// pair tree, one point a lane, in no order.
//
// Sources: Herbert Edelsbrunner, Ernst Muecke. Simulation of Simplicity. ACM Transactions on Graphics 9(1), 1990
// (ties); Sven Woop, Carsten Benthin, Ingo Wald. Watertight Ray/Triangle Intersection. JCGT 2(1), 2013 (vertices that
// move together). Differs from both: the ray is parallel to an axis, so that there is no shear.
//
// Result: a word a point, 1 inside, 0 outside; UNFINISHED if the walk did not finish. With BALLOT_EXACT a point
// is UNSURE if rounding may have decided; the host answers for it exactly.
//
// Why one ray is enough. Vertices are taken relative to the point, each coordinate rounded once. A vertex moves in the
// same way in every triangle that holds it, so the triangles are those of one moved mesh, as closed as the given one.
// Let (y, z) be the projection along the ray. The side of an edge p q is E = q.y p.z - q.z p.y, whose sign is exact
// (lib/numeric/products.glsl) and turns around with the edge. The ray is moved by an infinitesimal (dx, dy, dz) with
// dx >> dy >> dz, the same for all triangles: E becomes E + dy (q.z - p.z) + dz (p.y - q.y), as dy dz cancels. Where E
// is zero the first of the two differences that is not zero decides; if both are zero, the edge is a point in the
// projection, the other two sides are opposite, and the triangle is not crossed. So the moved ray meets no edge, and
// crosses a triangle if all three sides have one sign. Its line crosses a mesh whose edges all have an even number of
// triangles an even number of times. The crossings before and behind the point have one parity, which is that of the
// point moved by (dx, dy, dz) in the moved mesh.
//
// The bound, with w = 2^-24 and M the largest distance of a triangle's vertices from the point. Vertices move by w M.
// If the point is inside of the given mesh and outside of the moved one, or the other way round, some triangle passes
// through it on the way, which is then within w M of it. The crossing lies at X = sum of E_i x_i over the sum of E_i,
// all of one sign and with a relative error of 2 w. The products and sums round by 3 w. So the sign of X is wrong only
// if the moved triangle is within 5 w M of the point, and the given one within 6 w M. The answer is right for every
// point that is 8 w M away from the surface. 16 w M leave room. If no x_i is negative, or none positive, the sign is
// exact. Where the products E_i x_i may underflow, the E_i are scaled first. What remains is that the E_i of triangles
// smaller than 2^-88 R, which lie as near the ray, may lose their sign: such triangles can be missed.
//
// BALLOT_EXACT. With m the largest |y| or |z| of the vertices, these are off by w m, so a side is off by 4 w m m and
// terms of second order: B = 8 w m m and 2^-96 for what underflows. X is then off by 3 B + 8 w (the sum of |E_i|),
// times the largest |x|, and 2^-120 for what underflows. What is decided by more than that is decided exactly; so is a
// triangle behind the point, whose x are all negative.
//
// Boxes are widened by 128 w R (lib/query/frame.glsl), with R the reach of the scene, more than vertices move. Far
// points, which lie outside of the bounds of the scene, are outside. With BALLOT_EXACT they are UNSURE where their ray
// meets the bounds: in a mesh with open edges it may cross an odd number of triangles.
//
// lib/query/inside_instances.glsl has the test among instances.
#include "../lib/frame/kernel.glsl"
#include "../shared/query.h"
#include "../lib/query/frame.glsl"
#include "../lib/query/crossing.glsl"
#if BALLOT_INSTANCES
#include "../lib/query/inside_instances.glsl"
#endif

layout(set = 0, binding = BIND_CROSSINGS, scalar) writeonly buffer Answers { uint answers[]; };

#if BALLOT_EXACT
bool unsure = false;
const float UNDERFLOW_ROOM = 7.523164e-37;  // 2^-120
#else
const float UNDERFLOW = 7.888609e-31;  // 2^-100
#endif

// Returns true if the ray along +x crosses the triangle.
bool crosses(Probe p, uint texel) {
#if BALLOT_SHAPES
  if (walks_shapes()) {  // whether the shape holds the point, which is what a ray from there would tell
    vec3 normal, to = shape_foot(fetch_shape(leaf_texel(texel).w), p.at, normal);
    return shape_dot(normal, to) > 0.0;
  }
#endif
  Corners v = corners_around(p, fetch_triangle(texel, AS_STORED));
  vec2 a = v.v0.yz, b = v.v1.yz, c = v.v2.yz;
  float e0 = side_value(b, c), e1 = side_value(c, a), e2 = side_value(a, b);
  precise float x = e0 * v.v0.x + e1 * v.v1.x + e2 * v.v2.x;
#if BALLOT_EXACT
  vec3 m = larger(larger(abs(v.v0), abs(v.v1)), abs(v.v2));
  float size = larger(m.y, m.z), room = 4.7683716e-7 * size * size + 1.2621775e-29;
  float least = smaller(smaller(e0, e1), e2), most = larger(larger(e0, e1), e2);
  float ahead = larger(larger(v.v0.x, v.v1.x), v.v2.x);
  float off = (3.0 * room + 4.7683716e-7 * (abs(e0) + abs(e1) + abs(e2))) * m.x + UNDERFLOW_ROOM;
  bool passed = ahead < 0.0 || (least < -room && most > room);
  bool met = least > room || most < -room;
  float along = least > 0.0 ? x : -x;
  unsure = unsure || !(passed || (met && abs(x) > off));
  return met && along > off;
#else
  if (abs(x) < UNDERFLOW) {
    float scale = scale_for(larger(larger(abs(e0), abs(e1)), abs(e2)), 0u);
    precise float scaled = e0 * scale * v.v0.x + e1 * scale * v.v1.x + e2 * scale * v.v2.x;
    x = scaled;
  }
  int s0 = side_sign(e0, b, c), s1 = side_sign(e1, c, a), s2 = side_sign(e2, a, b);
  return s0 != 0 && s0 == s1 && s1 == s2 && (s0 > 0 ? x > 0.0 : x < 0.0);
#endif
}

// Returns true if the ray may meet the box.
bool may_meet(Probe p, NodeBox box) {
#if BALLOT_LAYOUT >= LAYOUT_CENTRED
  vec3 from = abs(box.a - p.from) - (box.b + p.pad);
  float ahead = box.a.x + (box.b.x + p.pad);
  return larger(from.y, from.z) <= 0.0 && ahead >= p.from.x - p.pad;
#else
  vec3 from = larger(box.a - (p.from + p.pad), (p.from - p.pad) - box.b);
  return larger(from.y, from.z) <= 0.0 && box.b.x >= p.from.x - 2.0 * p.pad;
#endif
}

void main() {
#if BALLOT_INSTANCES
  push = whole_push;
#endif
  uint index = push.ray_begin + gl_GlobalInvocationID.x;
  bool inside = index < push.ray_end;
  vec4 record = ray_half(inside ? index : push.ray_begin);
  bool live = inside && is_finite(record.xyz);
  Probe p = make_probe(live ? record.xyz : push.scene_lo);
  uint stack[STACK_SIZE];
  // Points far away are outside of the bounds.
  uint top = 0u, node = live && !p.far ? push.root : END_OF_TREE, crossings = 0u;
  stack[top++] = END_OF_TREE;
#if BALLOT_EXACT && !BALLOT_INSTANCES
  bvec3 below = lessThan(p.at, push.scene_lo), above = greaterThan(p.at, push.scene_hi);
  unsure = live && p.far && !any(below.yz) && !any(above);
#endif
#if BALLOT_INSTANCES
  begin_instances(live);
  for (node = next_instance(record.xyz, p); node != END_OF_TREE; top = 1u, node = next_instance(record.xyz, p))
#endif
  while (node != END_OF_TREE) {
    while (is_inner(node)) {
      Pair pair = fetch_pair(node);
      bool l = may_meet(p, pair.l), r = may_meet(p, pair.r);
      uint popped = stack[top - 1u];
      stack[top] = pair.right;
      top += uint(l && r);
      top -= uint(!(l || r));
      node = l ? pair.left : r ? pair.right : popped;
    }
    if (CAME_TO_LEAF(node)) {
      uint block = node & LEAF_TEXEL_MASK, count = (node >> LEAF_COUNT_SHIFT & 7u) + 1u, i = 0u;
      do {
        crossings += uint(crosses(p, block + LEAF_HEADER_TEXELS + i * TRIANGLE_TEXELS));
        ++i;
      } while (i < count);
      node = stack[--top];
    }
  }
  if (inside) {
    uint answer = crossings & 1u;
#if BALLOT_EXACT
    if (unsure) answer = UNSURE;
#endif
    answers[index] = finish_walks(1u) ? answer : UNFINISHED;
  }
}
