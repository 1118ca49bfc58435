// One ray against one leaf. A leaf's triangles are tested only if the ray meets the leaf's own box, whoever else of the
// subgroup does; whether a triangle's t then counts in this leaf is the numeric mode's rule (settle_t).

// Ray state that every method carries.
struct Walker {
  Ray ray;
  Slabs slabs;
  RaySpace space;
  Hit hit;         // nearest so far; t = t_max and prim = NO_HIT where there is none
  bool truncated;  // the driver left a triangle loop early
};

// By bits: a compiler may assume that floats are numbers.
bool is_finite(float x) { return (floatBitsToUint(x) & 0x7F800000u) != 0x7F800000u; }
bool is_finite(vec3 v) { return is_finite(v.x) && is_finite(v.y) && is_finite(v.z); }

// Dead rays: layout.h. A direction whose largest component is denormal is dead too: devices may flush it to zero.
bool is_dead(Ray ray) {
  vec3 a = abs(ray.dir);
  bool finite = is_finite(ray.origin) && is_finite(ray.dir) && is_finite(ray.t_min) && is_finite(ray.t_max);
  return !finite || !(ray.t_max > ray.t_min) || max(a.x, max(a.y, a.z)) < 1.17549435e-38;
}

Walker make_walker(Ray ray) {
  Walker w;
  w.ray = ray;
  w.slabs = make_slabs(ray);
  w.space = make_ray_space(ray);
  w.hit = Hit(ray.t_max, NO_HIT, 0.0, 0.0);
  w.truncated = false;
  return w;
}

// Entry of the box if the ray meets it no later than its nearest hit so far.
bool meets(Walker w, vec3 lo, vec3 hi, out float entry) {
  vec2 i = box_interval(w.slabs, lo, hi, w.ray.t_min, w.hit.t);
  entry = i.x;
  return i.x <= i.y;
}

void consider(inout Walker w, uint prim, vec3 v0, vec3 v1, vec3 v2, vec2 interval) {
  float t, t_error, u, v;
  bool hit = hit_triangle(w.ray, w.space, v0, v1, v2, t, t_error, u, v);
  hit = hit && t >= w.ray.t_min && t <= w.ray.t_max;
  hit = settle_t(t, t_error, interval) && hit;
  if (hit && (t < w.hit.t || (t == w.hit.t && prim < w.hit.prim))) w.hit = Hit(t, prim, u, v);
}

// Whether this ray's walk reaches the leaf: by the nearest hit so far, but with an interval that does not depend on it.
bool meets_leaf(Walker w, uvec4 lo, uvec4 hi, out vec2 interval) {
  interval = box_interval(w.slabs, uintBitsToFloat(lo.xyz), uintBitsToFloat(hi.xyz), w.ray.t_min, w.ray.t_max);
  return interval.x <= interval.y && interval.x <= w.hit.t;
}

void visit_leaf(inout Walker w, uint leaf, bool live) {
  uint texel = leaf & LEAF_TEXEL_MASK, count = (leaf >> LEAF_COUNT_SHIFT & 7u) + 1u;
  COUNT_LEAF(live, count)
  vec2 interval;
  bool inside = meets_leaf(w, leaf_texel(texel), leaf_texel(texel + 1u), interval) && live;
  uint i = 0u;
  if (inside) {
    texel += LEAF_HEADER_TEXELS;
    do {
      uvec4 a = leaf_texel(texel), b = leaf_texel(texel + 1u), c = leaf_texel(texel + 2u);
      consider(w, a.w, uintBitsToFloat(a.xyz), uintBitsToFloat(b.xyz), uintBitsToFloat(c.xyz), interval);
      COUNT_TRIANGLE()
      texel += TRIANGLE_TEXELS;
      ++i;
    } while (i < count);
    w.truncated = w.truncated || i < count;
  }
}
