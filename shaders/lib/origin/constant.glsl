// Origin policy "constant": a fixed share of the scene's diagonal along the geometric normal, 1e-4 unless told otherwise;
// what renderers call the scene's epsilon. Right for scenes of one size about the origin, by their author's choice.

vec3 origin_on(Surface s, float side) {
  precise vec3 origin = s.position + s.normal * (side * push.constant_offset);
  return origin;
}

Ray leave(Surface s, float side, vec3 dir, float t_max) { return Ray(origin_on(s, side), 0.0, dir, t_max); }
