// Tests one ray against one leaf. With BALLOT_LEAF_BOX the leaf's own box is tested again: since the leaf was pushed,
// the ray may have found a hit nearer than everything in the leaf, and rays of a packet come to leaves that they do not
// meet.

// The state of a ray during traversal, for every method.
struct Walker {
  Ray ray;         // scaled, and perhaps moved (lib/numeric/numeric.glsl)
  Slabs slabs;
  RaySpace space;
  Hit hit;         // nearest so far; t_max and NO_HIT if there is none; otherwise prim is a place (numeric.glsl)
#if BALLOT_CAMERA
  float scale;     // direction_scale() of the computed camera ray
#endif
};

// Tests the bits, because a compiler may assume that floats are never NaN or infinite.
bool is_finite(float x) { return (floatBitsToUint(x) & 0x7F800000u) != 0x7F800000u; }
bool is_finite(vec3 v) { return is_finite(v.x) && is_finite(v.y) && is_finite(v.z); }

// Dead rays are defined in layout.h. A ray is also dead if the largest component of its direction is denormal, because
// devices may flush it to zero.
#ifndef IS_EMPTY_RANGE
#define IS_EMPTY_RANGE(t_min, t_max) (!((t_max) > (t_min)))
#endif
bool is_dead(Ray ray) {
  vec3 a = abs(ray.dir);
  bool finite = is_finite(ray.origin) && is_finite(ray.dir) && is_finite(ray.t_min) && is_finite(ray.t_max);
  return !finite || IS_EMPTY_RANGE(ray.t_min, ray.t_max) || max(a.x, max(a.y, a.z)) < 1.17549435e-38;
}

// Whether a walk for any hit has come to its end, or goes on.
#if BALLOT_ANY_HIT == ANY_HIT_ASKED
bool takes_any;
#define HAS_ENDED(hit) (takes_any && (hit).prim != NO_HIT)
#define GOES_ON(hit) (!takes_any || (hit).prim == NO_HIT)
#else
#define HAS_ENDED(hit) ((hit).prim != NO_HIT)
#define GOES_ON(hit) ((hit).prim == NO_HIT)
#endif

Walker make_walker(Ray given) {
  Walker w;
  w.ray = scaled_ray(given);
  w.hit = Hit(w.ray.t_max, NO_HIT, 0.0, 0.0);
  w.space = make_ray_space(w.ray, given);
  w.slabs = make_slabs(w.ray);
#if BALLOT_CAMERA
  w.scale = direction_scale(given.dir);
#endif
  return w;
}

// Returns true if the ray meets the box with these bounds no later than its nearest hit so far. `entry` is t at the
// entry.
bool meets_bounds(Walker w, vec3 lo, vec3 hi, out float entry) {
  vec2 i = box_interval(w.slabs, lo, hi, w.ray.t_min, reach(w.space, w.hit));
  entry = i.x;
  return i.x <= i.y;
}

// The same for the box of a node.
bool meets(Walker w, NodeBox box, out float entry) {
#if BALLOT_LAYOUT >= LAYOUT_CENTRED
  vec2 i = centred_interval(w.slabs, box.a, box.b, w.ray.t_min, reach(w.space, w.hit));
  entry = i.x;
  return i.x <= i.y;
#else
  return meets_bounds(w, box.a, box.b, entry);
#endif
}

#if BALLOT_SHAPES
#include "../shape/shapes.glsl"

// Tests a shape, and keeps its nearest hit that counts if that is the nearest so far.
void consider_shape(inout Walker w, uint prim) {
  Shape shape = fetch_shape(prim);
  vec2 span;
  if (!shape_span(shape, w.ray, span)) return;
  [[unroll]] for (uint end = 0u; end < 2u; ++end) {
    float t = span[end];
    if (end >= shape_ends() || !may_count(w.space, t, w.ray, w.hit) || !nearer(w.space, t, prim, w.hit)) continue;
    vec2 uv = octahedral_of(shape_normal(shape, w.ray, span, end));
#ifdef CALLED_ACCEPT
    if (!is_accepted(Hit(t, prim, uv.x, uv.y))) continue;
#endif
    w.hit = Hit(t, prim, uv.x, uv.y);
  }
}
#endif

// Tests the i-th triangle of a leaf block, and keeps its hit if that is the nearest so far.
void consider(inout Walker w, uint block, uint i) {
#if BALLOT_SHAPES
  if (walks_shapes()) {
    consider_shape(w, leaf_texel(block + LEAF_HEADER_TEXELS + i * TRIANGLE_TEXELS).w);
    return;
  }
#endif
  float t, u, v;
  TriangleTexels triangle = fetch_triangle(block + LEAF_HEADER_TEXELS + i * TRIANGLE_TEXELS, texel_order(w.space));
#ifdef CALLED_INTERSECT
  bool hit = meets_shape(Ray(w.ray.origin, w.ray.t_min, w.ray.dir, w.hit.t), triangle.a.w, t, u, v);
#ifdef CALLED_IS_SHAPE
  if (!is_shape(scene_prim(triangle.a.w))) hit = hit_triangle(w.ray, w.space, triangle, t, u, v);
#endif
#else
  bool hit = hit_triangle(w.ray, w.space, triangle, t, u, v);
#endif
  if (hit && may_count(w.space, t, w.ray, w.hit)) {
    uint place = triangle_place(triangle, block, i);
#ifdef CALLED_ACCEPT
    if (nearer(w.space, t, place, w.hit) && is_accepted(Hit(t, place, u, v))) w.hit = Hit(t, place, u, v);
#else
    if (nearer(w.space, t, place, w.hit)) w.hit = Hit(t, place, u, v);
#endif
  }
}

bool meets_leaf(Walker w, uint block) {
  float entry;
  return meets_bounds(w, uintBitsToFloat(leaf_texel(block).xyz), uintBitsToFloat(leaf_texel(block + 1u).xyz), entry);
}

// Tests the triangles of a leaf. Without BALLOT_LEAF_LOOP every leaf of the tree holds one triangle. Gain without the
// loop, sponza with --max-leaf 1 on lavapipe 22.3.6, medians of four compiles, primary and diffuse rays: if-if 1.06 and
// 1.05 times as fast, packet 1.05 and 1.01, while-while 1.03 and 0.99.
void visit_leaf(inout Walker w, uint leaf, bool live) {
#if BALLOT_LEAF_LOOP
  uint block = leaf & LEAF_TEXEL_MASK, count = (leaf >> LEAF_COUNT_SHIFT & 7u) + 1u;
#else
  const uint block = leaf & LEAF_TEXEL_MASK, count = 1u;
#endif
  COUNT_LEAF(live, count)
#if BALLOT_LEAF_BOX
  bool inside = live && meets_leaf(w, block);
#else
  bool inside = live;
#endif
#if BALLOT_LEAF_LOOP
  uint i = 0u;
  if (inside) {
    do {
      consider(w, block, i);
      COUNT_TRIANGLE()
      ++i;
    } while (i < count);
  }
#else
  if (inside) {
    consider(w, block, 0u);
    COUNT_TRIANGLE()
  }
#endif
#ifdef TRIANGLE_SETTLES
  settle_leaf(w.space, w.hit);
#endif
}

#define MISS_T uintBitsToFloat(0x7F800000u)  // infinity

// Returns the result of a walk with its t times `scale`, and the prim instead of its place.
Hit finished_hit(Hit hit, float scale) {
  if (hit.prim == NO_HIT) return Hit(MISS_T, NO_HIT, 0.0, 0.0);
#ifdef TRIANGLE_SETTLES
  return hit;
#else
  return Hit(hit.t * scale, prim_at(hit.prim), hit.u, hit.v);
#endif
}
