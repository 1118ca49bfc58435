// The point that boxes are measured from.
//
// As box_origin() of engine/tree/host/box_origin.cpp. The host compares both and does without this tree if they differ.
vec3 box_origin(vec3 lo, vec3 hi) {
#if BALLOT_FLOAT64
  precise dvec3 sides = dvec3(hi) - dvec3(lo);
  double far = 16.0LF * max(sides.x, max(sides.y, sides.z));
#else
  precise vec3 sides = hi - lo;
  float far = 16.0 * max(sides.x, max(sides.y, sides.z));
#endif
  vec3 origin = vec3(0.0);
  for (int k = 0; k < 3; ++k) {
    float away = max(lo[k], -hi[k]);
    precise float middle = 0.5 * lo[k] + 0.5 * hi[k];
    if (away > 0.0 && away >= far) origin[k] = middle;
  }
  return origin;
}
