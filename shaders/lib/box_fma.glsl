// Box test "fma": one multiply-add a plane, lo * inv - origin * inv. The products cancel where the ray starts near a plane and
// far from the scene's origin, so the error follows the coordinates, not the distance.
//
// Source: Timo Aila, Samuli Laine. Understanding the Efficiency of Ray Traversal on GPUs. HPG 2009.

struct Slabs {
  vec3 scaled_origin, inv;  // origin * inv
};

Slabs make_slabs(Ray ray) {
  vec3 inv = reciprocal_direction(ray.dir);
  return Slabs(ray.origin * inv, inv);
}

vec2 box_interval(Slabs s, vec3 lo, vec3 hi, float t_min, float t_max) {
  return cut_interval(fma(lo, s.inv, -s.scaled_origin), fma(hi, s.inv, -s.scaled_origin), t_min, t_max);
}
