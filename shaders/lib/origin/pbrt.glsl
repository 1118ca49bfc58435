// Origin policy "pbrt": the bound of the point's own rounding error along the normal. The origin is on the right side
// of the plane, but the next triangle test rounds as well and may find the triangle again.
#include "error.glsl"

vec3 origin_on(Surface s, float side) {
  precise vec3 origin = s.position + s.normal * (side * position_error(s));
  return origin;
}

Ray leave(Surface s, float side, vec3 dir, float t_max) { return Ray(origin_on(s, side), 0.0, dir, t_max); }
