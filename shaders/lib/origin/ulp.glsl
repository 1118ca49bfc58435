// Origin policy "ulp": moves each coordinate by up to 256 ulp in the normal's direction. Near zero, where ulps shrink,
// it moves the coordinate by up to 2^-16 scene units instead.
//
// Source: Carsten Waechter, Nikolaus Binder. A Fast and Robust Method for Avoiding Self-Intersection. Ray Tracing Gems,
// chapter 6, 2019, with its three constants.

const float NEAR_ZERO = 1.0 / 32.0;
const float FLOAT_SCALE = 1.0 / 65536.0;
const float INT_SCALE = 256.0;

float moved(float p, float n) {
  int steps = int(INT_SCALE * n);
  float by_ulps = intBitsToFloat(floatBitsToInt(p) + (p < 0.0 ? -steps : steps));
  precise float by_length = p + FLOAT_SCALE * n;
  return abs(p) < NEAR_ZERO ? by_length : by_ulps;
}

vec3 origin_on(Surface s, float side) {
  vec3 n = s.normal * side;
  return vec3(moved(s.position.x, n.x), moved(s.position.y, n.y), moved(s.position.z, n.z));
}

Ray leave(Surface s, float side, vec3 dir, float t_max) { return Ray(origin_on(s, side), 0.0, dir, t_max); }
