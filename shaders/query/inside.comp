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
// lib/query/inside_instances.glsl has the test among instances. With BALLOT_LISTED the points are those of a list,
// which cells have not answered (cells.comp).
#include "../lib/frame/kernel.glsl"
#include "../shared/query.h"
#include "../lib/query/frame.glsl"
#include "../lib/query/crossing.glsl"
#if BALLOT_INSTANCES
#include "../lib/query/inside_instances.glsl"
#endif

layout(set = 0, binding = BIND_CROSSINGS, scalar) writeonly buffer Answers { uint answers[]; };
#if BALLOT_LISTED
layout(set = 0, binding = BIND_LISTED_POINTS, std430) readonly buffer ListedPoints { uint listed[]; };
#endif

#include "../lib/query/inside.glsl"

void main() {
#if BALLOT_INSTANCES
  push = whole_push;
#endif
#if BALLOT_LISTED
  uint place = push.ray_begin + gl_GlobalInvocationID.x;
  bool inside = place < push.ray_end;
  uint index = listed[inside ? place : push.ray_begin];
  vec4 record = ray_half(index);
#else
  uint index = push.ray_begin + gl_GlobalInvocationID.x;
  bool inside = index < push.ray_end;
  vec4 record = ray_half(inside ? index : push.ray_begin);
#endif
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
#include "../lib/query/inside_walk.glsl"
  if (inside) {
    uint answer = crossings & 1u;
#if BALLOT_EXACT
    if (unsure) answer = UNSURE;
#endif
    answers[index] = finish_walks(1u) ? answer : UNFINISHED;
  }
}
