// Areas of boxes for the SAH, in units of the square of some length: about the longest side of the scene, so that they
// stay in the range of float32. Sides below 2^-62 of it count as zero. So no product is denormal, and devices that take
// denormal numbers for zero find the areas that others find.
float unit;  // 1 over that length
const float LEAST_SIDE = 2.168404344971009e-19;  // 2^-62
float unit_of(float longest) { return min(1.0 / max(longest, 1e-37), 1e37); }

float half_area(vec3 lo, vec3 hi) {
  precise vec3 sides = (hi - lo) * unit;
  vec3 d = mix(sides, vec3(0.0), lessThan(sides, vec3(LEAST_SIDE)));
  precise float area = d.x * d.y + (d.y * d.z + d.z * d.x);
  return area;
}
