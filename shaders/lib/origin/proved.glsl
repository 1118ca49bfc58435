// Origin policy "proved": the smallest offset that is proved to be enough for watertight and exact arithmetic. Modes
// that round in other ways may find the triangle again.
#include "proof.glsl"

vec3 origin_towards(Surface s, float side, float cosine) {
  vec3 m = s.normal * side;
  float offset = proved_offset(s, m, cosine);
  precise vec3 origin = s.position + m * offset;
  return origin;
}

vec3 origin_on(Surface s, float side) { return origin_towards(s, side, 1.0); }

Ray leave(Surface s, float side, vec3 dir, float t_max) {
  return Ray(origin_towards(s, side, side * exact_dot(s.normal, dir)), 0.0, dir, t_max);
}
