// Discs: flat, met from both sides. A disc without radius is met by nothing.

bool disc_span(Shape disc, Ray ray, out vec2 t) {
  vec3 nearest = nearest_to(ray, disc.a.xyz, t.x);
  float along = dot_of(ray.dir, disc.b.xyz);
  precise float ahead = -dot_of(nearest, disc.b.xyz) / along;
  precise vec3 at = nearest + ahead * ray.dir;
  t = vec2(t.x + ahead);
  return along != 0.0 && length_of(at) <= disc.a.w && disc.a.w > 0.0;
}

// Returns the vector from a point to the nearest one of the disc. The normal is the disc's.
vec3 disc_foot(Shape disc, vec3 at, out vec3 normal) {
  normal = disc.b.xyz;
  precise vec3 from = at - disc.a.xyz;
  float height = dot_of(from, normal);
  precise vec3 across = from - normal * height;
  float s = length_of(across);
  precise vec3 to = across * (s > disc.a.w ? disc.a.w / s : 1.0) - from;
  return to;
}
