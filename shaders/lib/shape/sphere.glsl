// Spheres. A sphere without radius is met by nothing.
//
// Source: Eric Haines, Johannes Guenther, Tomas Akenine-Moeller. Precision Improvements for Ray/Sphere Intersection.
// Ray Tracing Gems, 2019: the chord by the ray's nearest point, whose distance from the centre does not cancel. The
// product (r - s) (r + s) takes the place of r r - s s.

bool sphere_span(vec4 sphere, Ray ray, out vec2 t) {
  vec3 nearest = nearest_to(ray, sphere.xyz, t.x);
  precise float s = length_of(nearest);
  precise float half_chord = sqrt(larger((sphere.w - s) * (sphere.w + s), 0.0) * ray_over2);
  t = vec2(t.x - half_chord, t.x + half_chord);
  return s <= sphere.w && sphere.w > 0.0;
}

// Returns the vector outwards from a point to the surface, and the outward normal there. A point at the centre is
// nearest to the end along +x.
vec3 sphere_foot(vec4 sphere, vec3 at, out vec3 normal) {
  precise vec3 from = at - sphere.xyz;
  float s = length_of(from);
  normal = s > 0.0 ? from / s : vec3(1.0, 0.0, 0.0);
  precise vec3 to = normal * (sphere.w - s);
  return to;
}
