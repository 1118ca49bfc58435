// Boxes along the axes. A box may be flat; one that is flat along two axes or more is met by nothing.

bool box_span(Shape box, Ray ray, out vec2 t) {
  vec3 over = 1.0 / ray.dir;
  precise vec3 a = (box.a.xyz - ray.origin) * over, b = (box.b.xyz - ray.origin) * over;
  t = vec2(-3.4e38, 3.4e38);
  bool met = true;
  [[unroll]] for (uint k = 0u; k < 3u; ++k) {
    if (ray.dir[k] == 0.0) {
      met = met && box.a[k] <= ray.origin[k] && ray.origin[k] <= box.b[k];
    } else {
      t.x = larger(t.x, smaller(a[k], b[k]));
      t.y = smaller(t.y, larger(a[k], b[k]));
    }
  }
  return met && t.x <= t.y;
}

// Returns the outward normal of the face that the ray enters or leaves through: the one that decides the span.
vec3 box_normal(Shape box, Ray ray, bool leaves) {
  vec3 over = 1.0 / ray.dir;
  precise vec3 a = (box.a.xyz - ray.origin) * over, b = (box.b.xyz - ray.origin) * over;
  vec3 normal = vec3(0.0);
  float decides = 3.4e38;
  [[unroll]] for (uint k = 0u; k < 3u; ++k) {
    if (ray.dir[k] == 0.0) continue;
    float t = leaves ? larger(a[k], b[k]) : -smaller(a[k], b[k]);
    if (t >= decides) continue;
    decides = t;
    normal = vec3(0.0);
    normal[k] = leaves == (ray.dir[k] > 0.0) ? 1.0 : -1.0;
  }
  return normal;
}

// Returns the vector from a point to the nearest one of the surface, and the outward normal of its face.
vec3 box_foot(Shape box, vec3 at, out vec3 normal) {
  precise vec3 below = box.a.xyz - at, above = at - box.b.xyz;  // how far outside of each face
  vec3 out_of = larger(below, above);
  normal = vec3(0.0);
  vec3 to = vec3(0.0);
  float most = larger(larger(out_of.x, out_of.y), out_of.z);
  [[unroll]] for (uint k = 0u; k < 3u; ++k) {
    float side = below[k] > above[k] ? -1.0 : 1.0;
    if (out_of[k] == most) normal = vec3(k == 0u ? side : 0.0, k == 1u ? side : 0.0, k == 2u ? side : 0.0);
    if (out_of[k] > 0.0) to[k] = -side * out_of[k];
  }
  return most > 0.0 ? to : normal * -most;
}
