// What the walk for the closest point of the triangles keeps, and what it answers. shaders/query/closest_point.comp has
// sources and proofs. A kernel includes this file behind lib/frame/kernel.glsl, and closest_walk.glsl where it walks.
#include "near.glsl"
#if BALLOT_INSTANCES
uint best_instance;  // of the answer so far
#endif

#if BALLOT_FILTERS
#include "filters.glsl"
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

#ifdef CALLED_ACCEPT
bool is_accepted(Probe p, uint texel, uint prim);
#endif

#if BALLOT_SHAPES
void store_shape(inout uvec4 first, inout uvec4 second, Probe p, Best best, float limit) {
  ShapeNear n = shape_near(best.texel);
  if (n.distance > limit) return;
  vec2 uv = octahedral_of(n.normal);
  precise vec3 to = vec3(move_x.x * n.to.x + move_x.y * n.to.y + move_x.z * n.to.z,
                         move_y.x * n.to.x + move_y.y * n.to.y + move_y.z * n.to.z,
                         move_z.x * n.to.x + move_z.y * n.to.y + move_z.z * n.to.z);
  first = uvec4(floatBitsToUint(p.at + to), floatBitsToUint(n.distance));
  second = uvec4(best.prim, floatBitsToUint(uv), 0u);
#if BALLOT_SIDES
  second.w = uint(shape_dot(n.normal, n.to) > 0.0);
#endif
}
#endif

void consider_nearest(Probe p, inout Best best, uint texel) {
  uint prim = PRIM_OF(texel);
#if BALLOT_FILTERS
  if (is_left_out(prim)) return;
#endif
  float d = DISTANCE2_OF(p, texel);
#ifdef CALLED_ACCEPT
  bool is_nearer = d < best.distance2 || (d == best.distance2 && prim < best.prim);
  if (is_nearer && is_accepted(p, texel, prim)) {
#else
  if (d < best.distance2 || (d == best.distance2 && prim < best.prim)) {
#endif
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
#if BALLOT_SHAPES
    if (walks_shapes()) {
      store_shape(first, second, p, best, limit);
    } else {
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
#if BALLOT_SHAPES
    }
#endif
  }
  if (!finish_walks(1u)) second.x = UNFINISHED;
  hit_words[2u * index] = first;
  hit_words[2u * index + 1u] = second;
}
