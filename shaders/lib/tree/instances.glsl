// Two levels: a tree of instances above the trees of their meshes. A method walks a mesh's tree by its own traverse(),
// with the ray in the mesh's own space.
//
// The definition. The answer of an instance is that of its object-space ray against its mesh:
//   origin'_i = (m_i0 * (o_0 - t_0) + m_i1 * (o_1 - t_1)) + m_i2 * (o_2 - t_2)
//   dir'_i    = (m_i0 * d_0 + m_i1 * d_1) + m_i2 * d_2
// where d is the direction that lib/numeric/ray_scale.glsl has scaled by a power of two, t the translation, m the
// inverse of the matrix, rounded to float32 (engine/tree/host/instance.h). Every operation is rounded by itself, so the
// ray is the same, to the last bit, on every device and on the host (numbers below 2^-126 may count as zero). t counts
// the same multiples in both spaces. Of all instances the hit with the smallest t counts; at equal t the smallest
// number: instances number their triangles one after the other.
//
// The crossings of a ray (shaders/query/crossings.comp) are those of all instances: the triangles that its object-space
// ray crosses in a mesh's space, where the infinitesimal steps of the rule for ties are taken too. So a closed mesh is
// crossed an even number of times from outside to outside, whatever the matrix. Crossings are in the order of t as
// reported, at equal t in that of the numbers; in mode exact those of one instance are in their exact order. A
// triangle's front is the side from which its moved vertices run counter-clockwise: a matrix that mirrors turns it.
//
// Mode "double": the ray of an instance is computed in double from the given one, with m and t as they are, and the hit
// with the smallest t in double counts.
//
// Closest points and the inside test have definitions of their own: lib/query/point_instances.glsl and
// inside_instances.glsl.
//
// The walk. Methods whose lanes stay together (packets, frontier) walk the top-level tree together too: they enter an
// instance if any lane wants it. With other methods each ray walks by itself, from one instance to its next.
//
// The box test. Boxes hold the mesh where the matrix moves it, widened by what does not depend on the ray; the rest of
// the error is at most `slack` times the largest distance along an axis between the ray's origin and the box
// (engine/tree/host/instance.cpp derives both). With w = 2^-24, this test itself moves a plane by w (its subtraction) +
// w (that of the slack) + 5 w (division) + w (product) = 8 w of that distance, which the slack has room for. The test
// is monotone: the interval of a box inside another one lies inside the other's, as slacks grow upwards in the tree. So
// no box culls a hit, and hits do not depend on the top-level tree.

#ifdef METHOD_PACKETS
#error a method with several rays in a lane has no kernel for instances
#endif
#if defined(PACKET_WALK) || defined(METHOD_REDUCES)
#define TOP_TOGETHER 1
#else
#define TOP_TOGETHER 0
#endif

#include "meshes.glsl"

// A ray on its way through the top-level tree.
Ray world;         // scaled
vec3 world_inv;    // its reciprocal direction
float world_scale;  // of t, from this scale to the given ray's
Hit best;          // the nearest hit so far: t on the scale of `world`, the number of its triangle
float best_open;   // no triangle that a walk has left open is hit before this t (numeric.glsl)
#if BALLOT_TRIANGLE == TRIANGLE_DOUBLE
DoubleRay world_in_double;  // scaled
double best_t;              // of `best`
#endif
#define RAY_INSTANCES  // has top_stack, top_height and first_prim
uint top_stack[TOP_STACK_SIZE];
uint top_height, top_node;
uint first_prim;     // number of the first triangle of the instance that is walked
bool is_mirrored;    // its matrix mirrors
float object_scale;  // of t, from the mesh's walk to the scale of `world`

#ifndef GIVEN_RAY
#define GIVEN_RAY load_ray
#endif

#if BALLOT_TRIANGLE == TRIANGLE_DOUBLE
void begin_in_double(Ray given) {
  uint e = direction_exponent(given.dir);
  double scale = packDouble2x32(uvec2(0u, (1150u - e) << 20)), inverse = packDouble2x32(uvec2(0u, (896u + e) << 20));
  DoubleRay r = given_in_double;
  world_in_double = DoubleRay(r.origin, r.t_min * inverse, r.dir * scale, r.t_max * inverse);
  best_t = world_in_double.t_max;
}

// Sets given_in_double to the ray of an instance, whose record has these rows, and returns that rounded.
Ray enter_in_double(vec4 x, vec4 y, vec4 z) {
  DoubleRay w = world_in_double;
  dvec3 rx = dvec3(x.xyz), ry = dvec3(y.xyz), rz = dvec3(z.xyz), from = w.origin - dvec3(x.w, y.w, z.w);
  dvec3 dir = w.dir;
  precise dvec3 o = dvec3(rx.x * from.x + rx.y * from.y + rx.z * from.z, ry.x * from.x + ry.y * from.y + ry.z * from.z,
                          rz.x * from.x + rz.y * from.y + rz.z * from.z);
  precise dvec3 d = dvec3(rx.x * dir.x + rx.y * dir.y + rx.z * dir.z, ry.x * dir.x + ry.y * dir.y + ry.z * dir.z,
                          rz.x * dir.x + rz.y * dir.y + rz.z * dir.z);
  given_in_double = DoubleRay(o, w.t_min, d, best_t);
  Ray ray = rounded(given_in_double);
  return Ray(ray.origin, clamp(ray.t_min, -3.4e38, 3.4e38), ray.dir, clamp(ray.t_max, -3.4e38, 3.4e38));
}
#endif

// Loads ray number `index` and begins its walk. Returns false if there is no such ray or the ray is dead.
bool begin_instances(uint index) {
  bool inside = index < RAY_END;
  Ray given = GIVEN_RAY(inside ? index : whole_push.ray_begin);
  bool live = inside && !is_dead(given);
  if (!live) given = Ray(vec3(0.0), 0.0, vec3(0.0, 0.0, 1.0), 0.0);
#if BALLOT_TRIANGLE == TRIANGLE_DOUBLE
  begin_in_double(given);
#endif
  world = scaled_ray(given);
  world_inv = reciprocal_direction(world.dir);
  world_scale = direction_scale(given.dir);
#if BALLOT_TRIANGLE == TRIANGLE_DOUBLE
  world.t_min -= abs(world.t_min) * 2.4e-7 + 1e-37;  // the range was rounded
  world.t_max = min(world.t_max + abs(world.t_max) * 2.4e-7, 3.4e38);
#endif
  best = Hit(world.t_max, NO_HIT, 0.0, 0.0);
  best_open = 3.4e38;
  top_stack[0] = END_OF_TREE;
  top_height = 1u;
#if TOP_TOGETHER
  top_node = subgroupAny(live) ? whole_push.root : END_OF_TREE;
#else
  top_node = live ? whole_push.root : END_OF_TREE;
#endif
  return live;
}

// Returns a t that no hit which may still count is beyond. A test that decides by exact t reports it to one ulp: there
// hits count whose exact t is up to an ulp beyond the best's. Two are granted.
float best_reach() {
#ifdef TRIANGLE_SETTLES
  if (best.prim == NO_HIT) return best.t;
  float ulps = abs(best.t) * 2.4e-7 + 1e-37;
  return min(world.t_max, best.t + ulps);
#else
  return best.t;
#endif
}

bool meets_top_box(vec3 lo, vec3 hi, float slack, out float entry) {
  precise vec3 to_lo = lo - world.origin, to_hi = hi - world.origin;
  vec3 far = larger(abs(to_lo), abs(to_hi));
  precise float pad = slack * larger(larger(far.x, far.y), far.z);
#if BALLOT_TRIANGLE == TRIANGLE_DOUBLE
  // The ray is rounded, and vertices in double are off where they are placed by shear_scale.
  vec3 size = larger(larger(abs(lo), abs(hi)), abs(world.origin));
  pad += 2.5e-7 * larger(larger(size.x, size.y), size.z) + whole_push.shear_scale;
#endif
  precise vec3 a = (to_lo - pad) * world_inv, b = (to_hi + pad) * world_inv;
  vec2 i = cut_interval(a, b, world.t_min, best_reach());
  entry = i.x;
  return i.x <= i.y;
}

// Continues to the nearer child of an inner node that is met, and pushes the other.
void top_step(bool live) {
  uvec4 a = top_texel(top_node), b = top_texel(top_node + 1u), c = top_texel(top_node + 2u),
        d = top_texel(top_node + 3u);
  float entry_l, entry_r;
  bool l = meets_top_box(uintBitsToFloat(a.xyz), uintBitsToFloat(b.xyz), uintBitsToFloat(b.w), entry_l);
  bool r = meets_top_box(uintBitsToFloat(c.xyz), uintBitsToFloat(d.xyz), uintBitsToFloat(d.w), entry_r);
#if TOP_TOGETHER
  bool nearer_right = l && r && live && entry_r < entry_l;
  l = subgroupAny(l && live);
  r = subgroupAny(r && live);
  bool right_first = r && (!l || subgroupAny(nearer_right));
#else
  bool right_first = r && (!l || entry_r < entry_l);
#endif
  if (l && r) top_stack[top_height++] = right_first ? a.w : c.w;
  top_node = right_first ? c.w : a.w;
  if (!l && !r) top_node = top_stack[--top_height];
}

// Begins the walk of an instance. `here` is false where the ray does not meet it. Returns the root of its mesh.
uint enter_instance(uint instance, inout Walker w, inout bool here) {
  uint at = top_push.records + instance * INSTANCE_TEXELS;
  uvec4 lo = top_texel(at + 3u), hi = top_texel(at + 4u);
  float entry;
  here = here && meets_top_box(uintBitsToFloat(lo.xyz), uintBitsToFloat(hi.xyz), uintBitsToFloat(hi.w), entry);
  uint root = enter_mesh(lo.w);
  uvec4 numbers = top_texel(at + 5u);
  first_prim = numbers.x;
  is_mirrored = numbers.y != 0u;
  vec4 x = uintBitsToFloat(top_texel(at)), y = uintBitsToFloat(top_texel(at + 1u)),
       z = uintBitsToFloat(top_texel(at + 2u));
  precise vec3 from = world.origin - vec3(x.w, y.w, z.w);
#if BALLOT_TRIANGLE == TRIANGLE_DOUBLE
  Ray given = enter_in_double(x, y, z);
#else
  Ray given = Ray(in_object(x, y, z, from), world.t_min, in_object(x, y, z, world.dir), best_reach());
#endif
  // The range may be a point: after a hit at t_min others at the same t still count.
  vec3 size = abs(given.dir);
  bool usable = is_finite(given.origin) && is_finite(given.dir) && max(size.x, max(size.y, size.z)) >= 1.17549435e-38;
  here = here && usable;
  if (!usable) given = Ray(vec3(0.0), 0.0, vec3(0.0, 0.0, 1.0), 0.0);
  object_scale = direction_scale(given.dir);
  w = make_walker(given);
  return root;
}

// Continues to the next instance: with methods whose lanes stay together the next that any lane meets. Returns the root
// of its mesh and begins the ray's walk there if `here`; returns END_OF_TREE if there is none.
uint next_instance(inout Walker w, bool live, out bool here) {
  here = false;
  uint root = END_OF_TREE;
  while (top_node != END_OF_TREE && root == END_OF_TREE) {
    while (is_inner(top_node)) top_step(live);
    if (CAME_TO_LEAF(top_node)) {
      here = live;
      root = enter_instance(top_node & ~LEAF_BIT, w, here);
      top_node = top_stack[--top_height];
#if TOP_TOGETHER
      if (!subgroupAny(here)) root = END_OF_TREE;
#else
      if (!here) root = END_OF_TREE;
#endif
    }
  }
  return root;
}
