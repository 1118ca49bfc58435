// Numeric mode "watertight": no ray slips between triangles that share an edge or a vertex, and no box culls a triangle
// that this test would accept.
//
// Source: Sven Woop, Carsten Benthin, Ingo Wald. Watertight Ray/Triangle Intersection. JCGT 2(1), 2013.
// Differs from the paper: the permutation to the ray's dominant axis is a product with rows of zeros, ones and the shear,
// which rounds exactly as the paper's select-and-subtract (products with 0 and 1 are exact) and needs no selects; there is no
// double fallback, because an edge function of exactly zero counts as inside; boxes are padded by one absolute bound a ray
// instead of the paper's shifted origins and scaled directions.
//
// `precise` forbids contraction: the edge function of one edge must round the same for both of its triangles. Products
// that differ only in order, c.x * b.y and b.y * c.x, then round alike, and rounding is monotone, so the sign of a non-zero
// edge function is never wrong; FMA would break both.

struct RaySpace {
  vec3 row_x, row_y, row_z;  // of the matrix that shears the ray onto the axis of its largest direction component
};

RaySpace make_ray_space(Ray ray) {
  vec3 d = ray.dir, a = abs(d);
  bool x = a.x >= a.y && a.x >= a.z, y = !x && a.y >= a.z;
  precise float inv = 1.0 / (x ? d.x : y ? d.y : d.z);
  precise float first = -(x ? d.y : y ? d.z : d.x) / (x ? d.x : y ? d.y : d.z);
  precise float second = -(x ? d.z : y ? d.x : d.y) / (x ? d.x : y ? d.y : d.z);
  if (x) return RaySpace(vec3(first, 1.0, 0.0), vec3(second, 0.0, 1.0), vec3(inv, 0.0, 0.0));
  if (y) return RaySpace(vec3(0.0, first, 1.0), vec3(1.0, second, 0.0), vec3(0.0, inv, 0.0));
  return RaySpace(vec3(1.0, 0.0, first), vec3(0.0, 1.0, second), vec3(0.0, 0.0, inv));
}

float along(vec3 row, vec3 p) {
  precise float sum = row.x * p.x + row.y * p.y + row.z * p.z;
  return sum;
}

bool hit_triangle(Ray ray, RaySpace space, vec3 v0, vec3 v1, vec3 v2, out float t, out float t_error, out float u,
                  out float v) {
  precise vec3 a = v0 - ray.origin, b = v1 - ray.origin, c = v2 - ray.origin;
  precise float ax = along(space.row_x, a), ay = along(space.row_y, a), az = along(space.row_z, a);
  precise float bx = along(space.row_x, b), by = along(space.row_y, b), bz = along(space.row_z, b);
  precise float cx = along(space.row_x, c), cy = along(space.row_y, c), cz = along(space.row_z, c);
  precise float p0 = cx * by, p1 = ax * cy, p2 = bx * ay, q0 = cy * bx, q1 = ay * cx, q2 = by * ax;
  precise float e0 = p0 - q0, e1 = p1 - q1, e2 = p2 - q2;
  precise float det = e0 + e1 + e2;
  precise float inv = 1.0 / det;
  precise float depth = e0 * az + e1 * bz + e2 * cz;
  t = depth * inv;
  u = e1 * inv;
  v = e2 * inv;
  precise float products = abs(p0) + abs(p1) + abs(p2) + (abs(q0) + abs(q1) + abs(q2));
  float extent = max(az, max(bz, cz)) - min(az, min(bz, cz));
  precise float error = products * (extent * 2.5e-7) * abs(inv);
  t_error = error;
  bool inside = min(e0, min(e1, e2)) >= 0.0 || max(e0, max(e1, e2)) <= 0.0;
  return inside && det != 0.0;
}

// Whether a hit counts in a leaf, and its t there: the rule that makes the answer independent of the order of the walk.
//
// Box and triangle arithmetic round differently, and t of a triangle seen edge-on can be off by much, so t can lie outside
// the interval in which the ray is inside the leaf's box. A walk that culls by the nearest t so far would find or lose such a
// hit depending on what it met before. Hence a hit counts only in a leaf whose interval it lies in, up to its own error
// (then it is clamped); a triangle that was split and is hit elsewhere counts in the leaf of that part. Intervals nest
// (lib/box.glsl), so every box above the leaf begins at or before t, and no walk culls the leaf of the smallest (t, prim):
// all methods, subgroup sizes and orders of rays give the same bits.
//
// The error: an edge function p - q is off by at most 2 w (|p| + |q|) (w = 2^-24: two products and a difference), so t, the
// mean of the vertices' depths weighted by them, by at most 2 w S extent / (|det| - 2 w S), S the sum of all |p| + |q|. With
// 2 w S at most |det| / 2 that is below 4 w S extent / |det|, and beyond it that bound exceeds the extent, which t, a mean with
// weights of one sign, never leaves. 2.5e-7 > 4 w. Moved vertices (below) and the rounding of t itself are part of the boxes'
// padding.
bool settle_t(inout float t, float t_error, vec2 interval) {
  precise float from = interval.x - t_error, to = interval.y + t_error;
  bool counts = t >= from && t <= to;
  t = max(min(t, interval.y), interval.x);
  return counts;
}

// Let M bound |p - o| on every axis for p in the scene's box, and w = 2^-24. To first order the test above moves a vertex
// sideways by at most w M (subtraction) + 5 w M (the shear's division, 2.5 ulp: Vulkan's precision of operations) + w M
// (error of the other coordinate, sheared) + w M (product) + 2 w M (sum) = 10 w M, and along the axis by 7 w M; t's own sums
// and reciprocal add 6 w M. It decides exactly on that moved triangle, but for edge functions that round to zero (accepted,
// and no further from the ray than the products' rounding: 2 w M). The slab test, (plane - (o -+ e)) * inv, moves a plane by
// w M (subtraction) + 5 w M (division) + w M (product). The sum is at most 22 w M; 32 w M leaves room for terms of second
// order, M's own rounding and the clamp of small directions (lib/box.glsl, 2^-59 M). o -+ e itself rounds by w |o -+ e|:
// 2 w |o| and the slack cover it.
vec3 box_padding(Ray ray) {
  vec3 far = max(abs(push.scene_lo - ray.origin), abs(push.scene_hi - ray.origin));
  float m = max(far.x, max(far.y, far.z));
  precise vec3 e = vec3(1.91e-6 * m) + 1.25e-7 * abs(ray.origin);
  return e;
}
