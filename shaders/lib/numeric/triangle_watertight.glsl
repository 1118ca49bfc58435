// Triangle test "watertight": no ray slips between triangles that share an edge or a vertex, and the result for a
// triangle depends on ray and triangle alone.
//
// Source: Sven Woop, Carsten Benthin, Ingo Wald. Watertight Ray/Triangle Intersection. JCGT 2(1), 2013.
//
// Differs from the paper in three ways. Edge functions get their exact sign in one way for all
// (lib/numeric/products.glsl), instead of a second pass in double where one is zero; their relative precision makes t
// as precise as the vertices, whatever cancels. The permutation that makes the ray's main axis z takes no instruction:
// leaves hold a texel of each coordinate, and a ray reads them in its own order. The power of two comes with the
// subtraction: v * scale - o * scale is (v - o) * scale to the last bit, unless o * scale underflows.
//
// Why the test is watertight: a vertex is sheared by the same operations in every triangle that holds it, so neighbours
// see one moved mesh, and the sign of an edge function is decided exactly on that mesh. Zero counts as inside, on both
// sides of an edge.
//
// How far vertices are moved, to first order, with w = 2^-24 and M at least |v - origin| on every axis. Across the main
// axis they move by w M (the subtraction) + w M (of the other coordinate, sheared) + 6 w M (the shear: a reciprocal to
// 2.5 ulp, Vulkan's limit, and a product) + w M (its product) + 2 w M (the sum, at most 2 M) = 11 w M. Along it,
// including what takes a depth to t, they move by w M + 5 w M + w M = 7 w M. t belongs to the point where the ray meets
// the moved triangle. Its weights are off by 2 w (edge function) + 4 w (det: two sums of numbers of one sign) +
// 5 w (reciprocal) + w (product) = 12 w, and the weighted sum of the depths by 3 w more: 15 w M over the main component
// of the direction. lib/numeric/box_padded.glsl builds on these bounds.
//
// Range: a power of two brings the scene's longest side to about 2^55. So products of edge functions do not overflow,
// and for vertices farther than 2^-106 of that side from the ray they lose nothing to underflow. Triangles smaller than
// that are missed. Rays from more than 16 to 32 longest sides away bring their own distance to 2^60. t itself must be a
// float32.
//
// engine/answer/host_walk.cpp repeats this arithmetic for a few rays on CPU devices.

#include "../tree/leaf_vertices.glsl"
#include "products.glsl"

// The constants of a ray, for its main axis m (0 x, 1 y, 2 z) and the axes that follow m in a circle.
struct RaySpace {
  uint order;                        // order_to(m)
  vec3 origin;                       // o[m + 1] and o[m + 2], scaled, and o[m]
  float scale, inv, first, second;   // the power of two; 1 / d[m]; d[m + 1] and d[m + 2] over -d[m], scaled
};

uint texel_order(RaySpace space) { return space.order; }

RaySpace make_ray_space(inout Ray ray, Ray given) {
  vec3 o = ray.origin, d = ray.dir, a = abs(d);
  bool x = a.x >= a.y && a.x >= a.z, y = !x && a.y >= a.z;
  vec3 inverse = reciprocal_direction(d);  // shared with the slabs, so that it is computed once
  float inv = x ? inverse.x : y ? inverse.y : inverse.z;
  float reach = box_reach(o);
  // The scale of rays from farther away, 2^(60 - exponent of reach). reach is then more than shear_near, at least
  // 2^-66, so the scale is a normal number.
  uint own = (314u - (floatBitsToUint(reach) >> 23)) << 23;
  float scale = reach <= push.shear_near ? push.shear_scale : uintBitsToFloat(own);
  precise float scaled = inv * scale;
  precise float first = -(x ? d.y : y ? d.z : d.x) * scaled, second = -(x ? d.z : y ? d.x : d.y) * scaled;
  vec3 origin = (x ? o.yzx : y ? o.zxy : o) * vec3(scale, scale, 1.0);
  return RaySpace(order_to(x ? 0u : y ? 1u : 2u), origin, scale, inv, first, second);
}

// Returns true if none of the three edge functions is below zero, or none is above zero.
bool are_of_one_sign(float a, float b, float c) {
#if BALLOT_PRODUCTS == PRODUCTS_FMA
  // By sign bits: the sum is -0 only if the difference is below zero and underflows, on devices whose zeros keep their
  // signs (tests/device/test_products.cpp). On an H200 (580.159.04) this is 1.005 times as fast.
  int i = floatBitsToInt(a), j = floatBitsToInt(b), k = floatBitsToInt(c);
  return (i | j | k) >= 0 || max(max(i, j), k) <= 0;
#else
  return smaller(smaller(a, b), c) >= 0.0 || larger(larger(a, b), c) <= 0.0;
#endif
}

// The texels hold x, y and z of the triangle's vertices, where z is the ray's main axis.
bool hit_triangle(Ray ray, inout RaySpace s, TriangleTexels triangle, out float t, out float u, out float v) {
  vec3 p = uintBitsToFloat(triangle.a.xyz), q = uintBitsToFloat(triangle.b.xyz);
  precise vec3 z = uintBitsToFloat(triangle.c.xyz) - s.origin.z;
  vec3 x = multiply_add(vec3(s.first), z, multiply_add(p, vec3(s.scale), vec3(-s.origin.x)));
  vec3 y = multiply_add(vec3(s.second), z, multiply_add(q, vec3(s.scale), vec3(-s.origin.y)));
  float e0 = difference_of_products(x.z, y.y, y.z, x.y), e1 = difference_of_products(x.x, y.z, y.x, x.z),
        e2 = difference_of_products(x.y, y.x, y.y, x.x);
  precise float det = e0 + e1 + e2;
  precise float inv = 1.0 / det;
  precise vec3 weights = vec3(e0, e1, e2) * inv;
  precise float distance = multiply_add(weights.z, z.z, multiply_add(weights.y, z.y, weights.x * z.x)) * s.inv;
  t = distance;
  u = weights.y;
  v = weights.z;
  return are_of_one_sign(e0, e1, e2) && det != 0.0;
}

#include "hit_order.glsl"
