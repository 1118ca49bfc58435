// Returns the unit vector, or zero if the normal is too short or not finite.
vec3 unit_or_zero(dvec3 n) {
  double size = max(abs(n.x), max(abs(n.y), abs(n.z)));
  // 1e-30 and 1e150 as in engine/model/placing.cpp, whose sum of squares overflows; NaN fails the comparison.
  if (!(size > 1e-30lf && size < 1e150lf)) return vec3(0.0);
  vec3 scaled = vec3(n / size);  // its length is 1 to 1.8
  return normalize(scaled);
}
