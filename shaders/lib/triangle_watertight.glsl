// Triangle test "watertight": no ray slips between triangles that share an edge or a vertex, and the answer for a triangle
// depends on ray and triangle alone.
//
// Source: Sven Woop, Carsten Benthin, Ingo Wald. Watertight Ray/Triangle Intersection. JCGT 2(1), 2013.
// Differs from the paper: edge functions get their exact sign in one way for all (lib/products.glsl) instead of a second pass
// in double where one is zero, and their relative precision makes t as precise as the vertices, whatever cancels. How vertices
// get to the ray's main axis is lib/shear_rows.glsl's business, or lib/shear_turned.glsl's.
//
// Why nothing leaks: a vertex is sheared by the same operations in every triangle that holds it, so neighbours see one moved
// mesh, and the sign of an edge function is decided exactly on it. Zero counts as inside, on both sides of an edge.
//
// How far vertices are moved, to first order, with w = 2^-24 and M at least |v - origin| on every axis: across the main axis
// by w M (the subtraction) + w M (of the other coordinate, sheared) + 6 w M (the shear: a reciprocal to 2.5 ulp, Vulkan's
// limit, and a product) + w M (its product) + 2 w M (the sum, at most 2 M) = 11 w M; along it by w M + 5 w M + w M = 7 w M. t, of the point where the ray
// meets the moved triangle: its weights are off by 2 w (edge function) + 4 w (det: two sums of numbers of one sign) + 5 w
// (reciprocal) + w (product) = 12 w, and the weighted sum of the depths by 3 w more: 15 w M over the main component of the
// direction. lib/box_padded.glsl builds on these bounds.
//
// Range: a power of two brings the farthest vertex that there may be to about 2^60, so that products of edge functions neither
// overflow nor, for vertices farther than 2^-111 M from the ray, lose anything to underflow. Triangles smaller than that
// are missed. t itself must be a float32.

#include "leaf_vertices.glsl"
#include "products.glsl"

// What the shear needs of a ray, for its main axis m and those that follow it in a circle.
struct Shear {
  uint axis;                         // m: 0 x, 1 y, 2 z
  float inv, first, second, scale;   // 1 / d[m]; d[m + 1] and d[m + 2] over -d[m], scaled; the scale, a power of two
};

Shear shear_of(Ray ray) {
  vec3 d = ray.dir, a = abs(d);
  bool x = a.x >= a.y && a.x >= a.z, y = !x && a.y >= a.z;
  uint reach = floatBitsToUint(scene_reach(ray.origin)) >> 23;
  float scale = uintBitsToFloat((clamp(314u, reach + 1u, reach + 253u) - reach) << 23);  // 2^(60 - exponent of reach)
  precise float inv = 1.0 / (x ? d.x : y ? d.y : d.z);
  precise float first = -(x ? d.y : y ? d.z : d.x) * inv * scale, second = -(x ? d.z : y ? d.x : d.y) * inv * scale;
  return Shear(x ? 0u : y ? 1u : 2u, inv, first, second, scale);
}

// A triangle's corners as seen from the ray's origin, sheared: the ray is the axis z.
struct Sheared {
  vec3 a, b, c;
};

bool hit_sheared(Sheared s, out float t, out float u, out float v) {
  float e0 = difference_of_products(s.c.x, s.b.y, s.c.y, s.b.x), e1 = difference_of_products(s.a.x, s.c.y, s.a.y, s.c.x),
        e2 = difference_of_products(s.b.x, s.a.y, s.b.y, s.a.x);
  precise float det = e0 + e1 + e2;
  precise float inv = 1.0 / det;
  u = e1 * inv;
  v = e2 * inv;
  precise float depth = e0 * inv * s.a.z + u * s.b.z + v * s.c.z;
  t = depth;
  bool inside = min(e0, min(e1, e2)) >= 0.0 || max(e0, max(e1, e2)) <= 0.0;
  return inside && det != 0.0;
}

#if BALLOT_PRODUCTS == PRODUCTS_FMA
#include "shear_rows.glsl"
#else
#include "shear_turned.glsl"
#endif
#include "nearer.glsl"
