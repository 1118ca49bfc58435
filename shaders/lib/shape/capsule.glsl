// Capsules and round cones: the convex hull of two spheres. The hull is these spheres and, between them, the frustum of
// the cone that touches both; each has one span on a ray, and the spans overlap. Where one sphere holds the other there
// is no frustum.
//
// With L the length of the axis a, k = r0 - r1: the cone touches the spheres at y = r0 k and L L + r1 k, where y counts
// multiples of 1 / L along the axis from end 0, and a point at y is within it if its square distance from the axis is
// at most g w w, with w = r0 - y k / (L L) and g = L L / (L L - k k).

bool frustum_span(Shape s, Ray ray, vec3 nearest, out vec2 t) {
  precise vec3 axis = s.b.xyz - s.a.xyz;
  precise float k = s.a.w - s.b.w, length2 = dot_of(axis, axis), rest = length2 - k * k;
  t = vec2(0.0);
  if (!(rest > 0.0)) return false;
  float over = 1.0 / length2, g = length2 / rest;
  precise float from = s.a.w * k, to = length2 + s.b.w * k;
  float y = dot_of(nearest, axis), along = dot_of(ray.dir, axis);
  precise vec2 slab = (vec2(from, to) - y) / along;
  if (along == 0.0) slab = y >= from && y <= to ? vec2(-3.4e38, 3.4e38) : vec2(1.0, 0.0);
  if (slab.x > slab.y && along != 0.0) slab = slab.yx;
  // From the ray's point nearest to the axis on, so that the distance from the axis does not cancel.
  precise vec3 across = nearest - axis * (y * over), turn = ray.dir - axis * (along * over);
  precise float steep = dot_of(turn, turn), shift = -dot_of(across, turn) / steep;
  shift = steep > 0.0 ? clamp(shift, slab.x, slab.y) : slab.x;
  across = across + shift * turn;
  precise float w = s.a.w - (y + shift * along) * k * over, grows = -along * k * over;
  precise float root = sqrt(g) * w, s0 = length_of(across);
  precise float a = steep - g * grows * grows, b = dot_of(across, turn) - g * w * grows, c = (s0 - root) * (s0 + root);
  precise float inner = b * b - a * c;
  t = slab - shift;
  if (inner < 0.0) {
    if (a >= 0.0) return false;  // beside the cone
  } else {
    precise float q = -(b + (b < 0.0 ? -sqrt(inner) : sqrt(inner)));
    float x = q / a, z = c / q, lo = smaller(x, z), hi = larger(x, z);
    if (q == 0.0) lo = hi = 0.0;
    if (a == 0.0 && b == 0.0)
      t.y = c <= 0.0 ? t.y : t.x - 1.0;
    else if (a > 0.0)
      t = vec2(larger(t.x, lo), smaller(t.y, hi));
    else if (a == 0.0)
      t = b > 0.0 ? vec2(t.x, smaller(t.y, z)) : vec2(larger(t.x, z), t.y);
    else if (grows > 0.0)
      t.x = larger(t.x, hi);
    else
      t.y = smaller(t.y, lo);
  }
  bool met = t.x <= t.y;
  t += shift;
  return met;
}

bool capsule_span(Shape s, Ray ray, out vec2 t) {
  float at0;
  vec3 nearest = nearest_to(ray, s.a.xyz, at0);
  vec2 end0, end1, middle;
  bool met0 = sphere_span(s.a, ray, end0), met1 = sphere_span(s.b, ray, end1);
  bool met = frustum_span(s, ray, nearest, middle);
  middle += at0;
  t = vec2(3.4e38, -3.4e38);
  if (met0) t = vec2(smaller(t.x, end0.x), larger(t.y, end0.y));
  if (met1) t = vec2(smaller(t.x, end1.x), larger(t.y, end1.y));
  if (met) t = vec2(smaller(t.x, middle.x), larger(t.y, middle.y));
  return met0 || met1 || met;
}

// Returns the outward normal of the hull's surface where it is nearest to a point, relative to end 0, and that point's
// signed distance from the surface: negative inside.
vec3 capsule_normal(Shape s, vec3 from, out float distance) {
  precise vec3 axis = s.b.xyz - s.a.xyz;
  precise float k = s.a.w - s.b.w, length2 = dot_of(axis, axis), rest = length2 - k * k;
  precise vec3 beyond = from - axis;
  float y = dot_of(from, axis);
  precise vec3 across = from - axis * (rest > 0.0 ? y / length2 : 0.0);
  float s0 = length_of(across);
  // The part whose normal goes through the point: where it would meet the axis.
  float tilt = rest > 0.0 ? k / sqrt(rest) : 0.0;
  precise float foot = y - s0 * tilt * sqrt(length2);
  bool first = rest > 0.0 ? foot <= 0.0 : k >= 0.0, last = !first && (foot >= length2 || !(rest > 0.0));
  vec3 v = first ? from : beyond;
  float size = length_of(v);
  vec3 normal = size > 0.0 ? v / size : vec3(1.0, 0.0, 0.0);
  distance = size - (first ? s.a.w : s.b.w);
  if (!first && !last) {
    float over = 1.0 / sqrt(length2);
    vec3 side = s0 > 0.0 ? across / s0 : any_across(axis);
    precise float sine = k * over, cosine = sqrt(rest) * over;
    normal = side * cosine + axis * (over * sine);
    precise float d = (s0 - (s.a.w - y * k / length2) * sqrt(length2 / rest)) * cosine;
    distance = d;
  }
  return normal;
}
