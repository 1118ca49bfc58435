// Directions about a normal.

const float PI = 3.14159265;

float luminance(vec3 c) { return dot(c, vec3(0.2126, 0.7152, 0.0722)); }

// Returns two unit vectors that are perpendicular to the unit vector n and to each other (Duff et al., Building an
// Orthonormal Basis, Revisited, JCGT 2017).
void basis_of(vec3 n, out vec3 x, out vec3 y) {
  float s = n.z >= 0.0 ? 1.0 : -1.0;
  float a = -1.0 / (s + n.z), b = n.x * n.y * a;
  x = vec3(1.0 + s * n.x * n.x * a, s * b, -s * n.x);
  y = vec3(b, s + n.y * n.y * a, -n.y);
}

// Samples a unit direction about n with a density proportional to the cosine.
vec3 cosine_about(vec3 n, vec2 r) {
  vec3 x, y;
  basis_of(n, x, y);
  float radius = sqrt(r.x), phi = 2.0 * PI * r.y;
  return normalize(x * (radius * cos(phi)) + y * (radius * sin(phi)) + n * sqrt(max(1.0 - r.x, 0.0)));
}
