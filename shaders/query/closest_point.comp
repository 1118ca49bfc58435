#version 460
#extension GL_GOOGLE_include_directive : require
// Closest point: for each point, the nearest point on the triangles of the tree. A walk of the pair tree, one point a
// lane, nearest child first.
//
// Sources: Christer Ericson. Real-Time Collision Detection. 2005, section 5.1.5 (the regions of a triangle). Differs:
// the regions are decided so that thin triangles lose no precision, and boxes are culled by a proved bound.
//
// Result: two texels a point, (point.xyz, distance), (prim, u, v, behind). Without a triangle within the limit prim is
// NO_HIT, distance infinite, and the rest zero. A walk that did not finish has prim UNFINISHED.
//
// With BALLOT_SIDES `behind` tells whether the point is on the inner side of the surface: by the pseudonormal of the
// part of the triangle that the nearest point is in, which for its inside is its normal
// (engine/tree/host/pseudonormals.h has the source). Else it is 0.
//
// The answer is the least of the distances that nearest_of() computes over all triangles within the limit, and among
// equal ones the triangle with the smallest prim. That number depends on point and triangle alone, so the answer
// depends neither on the tree nor on the order of the walk, but for points that are `far` (lib/query/frame.glsl).
// Triangles that share an edge or a vertex compute equal numbers for it: each operation on an edge is symmetric in its
// ends. So where the nearest point is computed to be on it, the triangle is the first of those that share it.
//
// The bound, with w = 2^-24, to first order. For a triangle let D be its distance from the point P and M the largest
// distance of its vertices from P, so M <= D + (its longest edge).
//
// Vectors. a, b, c (vertices minus P) are rounded once, by w M. An edge is rounded by w of itself, at most 2 w M.
// Vertices. |a|^2 rounds by 3 w of itself, so |a| by 1.5 w M.
// Edges. The ends' parts t_a = -a . e and t_b = b . e are off by w M |e| (a) + w M |e| (e) + 3 w M |e| (the sum of
//   products) = 5 w M |e| each. Their sum replaces |e|^2. So the foot (a t_b + b t_a) / (t_a + t_b) moves along the
//   edge by at most 15 w M, and its own rounding is 6 w M. It is a point of the edge within 21 w M of the nearest one,
//   and its length rounds by 1.5 w M. If t_a or t_b has the wrong sign, an end lies within 5 w M of the nearest point.
//   Where |e| is below 15 w M, any point of the edge will do.
// Plane. Let T be the triangle with the corner a and the edges ab and bc as rounded: each of its points lies within
//   5 w M of the given triangle's. Its normal n is found by differences of products whose relative error is 2 w a
//   component, whatever cancels (lib/numeric/products.glsl), so n is turned by at most 2 w. A side's distance
//   (n x e) . a / (|n| |e|) is then off by 2 w M (n) + 3 w M (the cross product) + 3 w M (the sum) + 4 w M (the edge
//   ca, which T has otherwise) = 12 w M =: s. The distance from the plane, |n . a| / |n|, is off by 7 w M.
// Region. The foot of the perpendicular counts as inside if all sides say so and it lies between the ends of the
//   longest edge. Suppose it does. Then it is within s outside of each line and within 5 w M + 8 w M (the edges are
//   compared by t_a + t_b) of the slab over that edge, whose angles are at most right. So it lies within
//   sqrt(3) s + 13 w M = 34 w M of T: beside an edge by s; past an end of the longest edge by sqrt(3) s at most,
//   because the angle there is at most right; past the third corner, whose angle is at least 60 degrees, by 2 s.
//   Suppose the foot is inside T but does not count. Then it lies within 13 w M of an edge, or outside of the slab's
//   computed ends and so within 13 w M of an edge that meets the slab there. That edge's own distance is taken.
// In all, the computed distance of a triangle differs from D by at most 5 + 34 + 7 + 2 = 48 w M. 64 w M leave room for
// terms of second order and the square root.
//
// Underflow. R (below) is scaled into [2^38, 2^39). A component of the normal is off by 2^-122 where its products
// underflow. A normal whose components are all below 2^-98 is taken for zero, and the triangle for its edges: its least
// height is below 2^-48, or 2^-86 R. An edge whose squared length is below 2^-102 is taken for its ends, which are
// within 2^-90 R. So the bound is 2^-85 R larger.
//
// So the distance of the reported triangle is at most that of the nearest one plus 64 w (M + M') + 2^-85 R, with M'
// that of the nearest triangle.
//
// Boxes. R, the largest distance of P from a point of the scene along an axis, is at least M / sqrt(3). A box culls a
// triangle only if its computed distance surely exceeds the best: 64 sqrt(3) w R = 111 w R for the triangle's distance,
// 6 w R for the box's planes, 4 w R for the sum of squares and 3 w R for a box origin other than zero make 124 w R.
// Boxes are widened by 128 w R. Taking e from each positive component of a vector makes it shorter by e at least.
// Far points are not padded: what is culled for them is less near by 9 w R at most, which is below w M 64.
//
// lib/query/point_instances.glsl has the triangles and the boxes of scenes with instances.
// engine/answer/host_walk_points.cpp repeats this arithmetic for a few points on CPU devices.
#include "../lib/frame/kernel.glsl"
#include "../shared/query.h"
#include "../lib/query/near.glsl"
#if BALLOT_INSTANCES
uint best_instance;  // of the answer so far
#endif

#if BALLOT_SIDES
layout(set = 0, binding = BIND_PSEUDONORMALS, scalar) readonly buffer Pseudonormals { vec3 pseudonormals[]; };
#endif

// The answer so far.
struct Best {
  float distance2;  // scaled; of the limit as long as there is none
  float reach2;     // boxes farther away than this are culled
  uint prim, texel;
};

// Returns the largest square at which a box may still hold something nearer.
float reach_of(Probe p, float distance2) {
  return p.far ? uintBitsToFloat(floatBitsToUint(distance2) - 1u) : distance2;
}

void consider_nearest(Probe p, inout Best best, uint texel) {
  uint prim = PRIM_OF(texel);
  float d = nearest_of(around(p, texel)).distance2;
  if (d < best.distance2 || (d == best.distance2 && prim < best.prim)) {
    best.distance2 = d;
    best.reach2 = reach_of(p, d);
    best.prim = prim;
    best.texel = texel;
#if BALLOT_INSTANCES
    best_instance = instance;
#endif
  }
}

// The nearest point of a triangle, and the part of the triangle that it is in.
struct Foot {
  vec3 at;       // relative to the probe and scaled
  vec3 weights;  // of the corners
  uint part;     // PART_... or a corner or edge
};

// Returns the foot whose squared distance was the least.
Foot foot_of(Around t, Near n) {
  float d = n.distance2;
  Foot f = Foot(t.a, vec3(1.0, 0.0, 0.0), 0u);
  if (square(t.b) == d) f = Foot(t.b, vec3(0.0, 1.0, 0.0), 1u);
  if (square(t.c) == d) f = Foot(t.c, vec3(0.0, 0.0, 1.0), 2u);
  if (n.ab.between && square(n.ab.foot) == d) f = Foot(n.ab.foot, vec3(n.ab.at_q, n.ab.at_p, 0.0), PART_EDGE);
  if (n.bc.between && square(n.bc.foot) == d) f = Foot(n.bc.foot, vec3(0.0, n.bc.at_q, n.bc.at_p), PART_EDGE + 1u);
  if (n.ca.between && square(n.ca.foot) == d) f = Foot(n.ca.foot, vec3(n.ca.at_p, 0.0, n.ca.at_q), PART_EDGE + 2u);
  if (n.inside && n.plane == d) f = Foot(n.normal * (n.depth / n.normal2), -n.sides, PART_INSIDE);
  f.weights /= f.weights.x + f.weights.y + f.weights.z;
  return f;
}

#if BALLOT_SIDES
// Returns true if the probe is on the inner side of the part of a triangle that its nearest point is in.
bool is_behind(Near n, Foot f, uint prim) {
  if (f.part == PART_INSIDE) return n.depth > 0.0;
  return dot_of(pseudonormals[PSEUDONORMALS * prim + f.part], f.at) > 0.0;
}
#endif

// Writes the answer.
void store_nearest(uint index, Probe p, Best best, float limit) {
  uvec4 first = uvec4(0u, 0u, 0u, 0x7F800000u), second = uvec4(NO_HIT, 0u, 0u, 0u);
  if (best.prim != NO_HIT) {
#if BALLOT_INSTANCES
    enter_instance(p, best_instance);
#endif
    Around t = around(p, best.texel);
    Near n = nearest_of(t);
    Foot f = foot_of(t, n);
    float inverse = 1.0 / p.scale;
    precise float root = sqrt(n.distance2);
    float distance = root * inverse;
    vec3 at = p.at + f.at * inverse;
    if (distance <= limit) {
      first = uvec4(floatBitsToUint(at), floatBitsToUint(distance));
      second = uvec4(best.prim, floatBitsToUint(f.weights.yz), 0u);
#if BALLOT_SIDES
      second.w = uint(is_behind(n, f, best.prim));
#endif
    }
  }
  if (!finish_walks(1u)) second.x = UNFINISHED;
  hit_words[2u * index] = first;
  hit_words[2u * index + 1u] = second;
}

void main() {
#if BALLOT_INSTANCES
  begin_scene();
#endif
  uint index = push.ray_begin + gl_GlobalInvocationID.x;
  bool inside = index < push.ray_end;
  vec4 record = ray_half(inside ? index : push.ray_begin);
  float limit = record.w;
  bool live = inside && is_finite(record.xyz) && is_limit(limit);
  Probe p = make_probe(live ? record.xyz : push.scene_lo);
  PROBE_STACK_DECLARE
  uint top = 0u, node = live ? push.root : END_OF_TREE;
  stack[top] = END_OF_TREE;
  stack_near[top++] = -1.0;
  float limit2 = limit_distance2(p, limit);
  Best best = Best(limit2, limit2, NO_HIT, 0u);
#if BALLOT_INSTANCES
  begin_instances(live);
  for (node = next_instance(p, best.reach2); node != END_OF_TREE; top = 1u, node = next_instance(p, best.reach2))
#endif
  while (node != END_OF_TREE) {
    while (is_inner(node)) {
      Pair pair = fetch_pair(node);
      float l = box_distance2(p, pair.l), r = box_distance2(p, pair.r);
      bool right_first = r < l;
      uint first = right_first ? pair.right : pair.left, other = right_first ? pair.left : pair.right;
      float near = smaller(l, r), next = larger(l, r);
      bool any = near <= best.reach2, both = next <= best.reach2;
      stack[top] = other;
      stack_near[top] = next;
      top += uint(both);
      node = first;
      if (!any) {
        do {
          --top;
        } while (stack_near[top] > best.reach2);
        node = stack[top];
      }
    }
    if (CAME_TO_LEAF(node)) {
      uint block = node & LEAF_TEXEL_MASK, count = (node >> LEAF_COUNT_SHIFT & 7u) + 1u, i = 0u;
      do {
        consider_nearest(p, best, block + LEAF_HEADER_TEXELS + i * TRIANGLE_TEXELS);
        ++i;
      } while (i < count);
      do {
        --top;
      } while (stack_near[top] > best.reach2);
      node = stack[top];
    }
  }
  if (inside) store_nearest(index, p, best, limit);
}
