// One triangle and one box of the inside test: whether the ray along +x from a point crosses or may meet them. The
// proofs are in shaders/query/inside.comp. A kernel includes this file after crossing.glsl.

#if BALLOT_EXACT
bool unsure = false;
const float UNDERFLOW_ROOM = 7.523164e-37;  // 2^-120
#else
const float UNDERFLOW = 7.888609e-31;  // 2^-100
#endif

// Returns true if the ray along +x crosses the triangle.
bool crosses(Probe p, uint texel) {
#if BALLOT_SHAPES
  if (walks_shapes()) {  // whether the shape holds the point, which is what a ray from there would tell
    vec3 normal, to = shape_foot(fetch_shape(leaf_texel(texel).w), p.at, normal);
    return shape_dot(normal, to) > 0.0;
  }
#endif
  Corners v = corners_around(p, fetch_triangle(texel, AS_STORED));
  vec2 a = v.v0.yz, b = v.v1.yz, c = v.v2.yz;
  float e0 = side_value(b, c), e1 = side_value(c, a), e2 = side_value(a, b);
  precise float x = e0 * v.v0.x + e1 * v.v1.x + e2 * v.v2.x;
#if BALLOT_EXACT
  vec3 m = larger(larger(abs(v.v0), abs(v.v1)), abs(v.v2));
  float size = larger(m.y, m.z), room = 4.7683716e-7 * size * size + 1.2621775e-29;
  float least = smaller(smaller(e0, e1), e2), most = larger(larger(e0, e1), e2);
  float ahead = larger(larger(v.v0.x, v.v1.x), v.v2.x);
  float off = (3.0 * room + 4.7683716e-7 * (abs(e0) + abs(e1) + abs(e2))) * m.x + UNDERFLOW_ROOM;
  bool passed = ahead < 0.0 || (least < -room && most > room);
  bool met = least > room || most < -room;
  float along = least > 0.0 ? x : -x;
  unsure = unsure || !(passed || (met && abs(x) > off));
  return met && along > off;
#else
  if (abs(x) < UNDERFLOW) {
    float scale = scale_for(larger(larger(abs(e0), abs(e1)), abs(e2)), 0u);
    precise float scaled = e0 * scale * v.v0.x + e1 * scale * v.v1.x + e2 * scale * v.v2.x;
    x = scaled;
  }
  int s0 = side_sign(e0, b, c), s1 = side_sign(e1, c, a), s2 = side_sign(e2, a, b);
  return s0 != 0 && s0 == s1 && s1 == s2 && (s0 > 0 ? x > 0.0 : x < 0.0);
#endif
}

// Returns true if the ray may meet the box.
bool may_meet(Probe p, NodeBox box) {
#if BALLOT_LAYOUT >= LAYOUT_CENTRED
  vec3 from = abs(box.a - p.from) - (box.b + p.pad);
  float ahead = box.a.x + (box.b.x + p.pad);
  return larger(from.y, from.z) <= 0.0 && ahead >= p.from.x - p.pad;
#else
  vec3 from = larger(box.a - (p.from + p.pad), (p.from - p.pad) - box.b);
  return larger(from.y, from.z) <= 0.0 && box.b.x >= p.from.x - 2.0 * p.pad;
#endif
}
