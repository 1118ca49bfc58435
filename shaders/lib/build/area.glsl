// Areas of boxes for the SAH, in units of the square of some length: about the longest side of the scene, so that they
// stay in the range of float32.
float unit;  // 1 over that length
float unit_of(float longest) { return min(1.0 / max(longest, 1e-37), 1e37); }

float half_area(vec3 lo, vec3 hi) {
  precise vec3 d = (hi - lo) * unit;
  precise float area = d.x * d.y + (d.y * d.z + d.z * d.x);
  return area;
}
