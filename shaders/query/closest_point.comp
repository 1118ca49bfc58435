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
#include "../lib/query/closest_point.glsl"

#if BALLOT_BLOCKS
layout(set = 0, binding = BIND_NEIGHBOUR_STATE, scalar) readonly buffer Neighbours { NeighbourState neighbours; };
layout(set = 0, binding = BIND_SORTED, scalar) readonly buffer Sorted { IndirectArgs sorted; };
layout(set = 0, binding = BIND_ORDER_NEAR, std430) readonly buffer OrderNear { uint order_near[]; };
layout(set = 0, binding = BIND_ORDER_SORTED, std430) readonly buffer OrderSorted { uint order_sorted[]; };
uint point_at(uint index) {
  uint place = index - neighbours.first;
  return sorted.count > 0u ? neighbours.first + order_sorted[place] : order_near[place];
}
#else
uint point_at(uint index) { return index; }
#endif

#if BALLOT_BLOCKS && BALLOT_UNIFORM_FLOW
void main() [[subgroup_uniform_control_flow]] {
#else
void main() {
#endif
#if BALLOT_INSTANCES
  begin_scene();
#endif
  uint place = push.ray_begin + gl_GlobalInvocationID.x;
  bool inside = place < push.ray_end;
  uint index = point_at(inside ? place : push.ray_begin);
  vec4 record = ray_half(index);
#if BALLOT_FILTERS
  begin_filters(index);
#endif
#include "../lib/query/closest_walk.glsl"
  if (inside) store_nearest(index, p, best, limit);
}
