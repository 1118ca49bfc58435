"""GLSL for the examples: random numbers, and rays that leave a surface."""

PATHS = """
uint state, left_from;  // of random(), and the triangle that a ray comes from
float random() {  // PCG, O'Neill 2014
  state = state * 747796405u + 2891336453u;
  uint x = ((state >> ((state >> 28) + 4u)) ^ state) * 277803737u;
  return float((x >> 22 ^ x) >> 8) / 16777216.0;
}
vec3 scattered(vec3 normal) {  // with a density proportional to the cosine
  float z = 2.0 * random() - 1.0, phi = 6.2831853 * random(), r = sqrt(1.0 - z * z);
  return normal + 0.999 * vec3(r * cos(phi), r * sin(phi), z);
}
bool accept(Hit hit) { return hit.prim != left_from; }  // no ray meets what it comes from
"""
