// Origin policy "constant": a fixed fraction of the scene's diagonal along the geometric normal, 1e-4 by default.
// Renderers call it the scene's epsilon. It is right for scenes of one size near the origin, if their author chose it.

vec3 origin_on(Surface s, float side) {
  precise vec3 origin = s.position + s.normal * (side * push.constant_offset);
  return origin;
}

Ray leave(Surface s, float side, vec3 dir, float t_max) { return Ray(origin_on(s, side), 0.0, dir, t_max); }
