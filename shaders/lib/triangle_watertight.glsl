// Triangle test "watertight": no ray slips between triangles that share an edge or a vertex, and the answer for a triangle
// depends on ray and triangle alone.
//
// Source: Sven Woop, Carsten Benthin, Ingo Wald. Watertight Ray/Triangle Intersection. JCGT 2(1), 2013.
// Differs from the paper: the permutation to the ray's main axis is a product with rows of a power of two, the shear and
// zeros, which needs no selects; edge functions get their exact sign in one way for all (lib/products.glsl) instead of a
// second pass in double where one is zero; and their relative precision makes t as precise as the vertices, whatever cancels.
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

struct RaySpace {
  vec3 row_x, row_y, row_z;  // of the matrix that shears the ray onto the axis of its largest direction component
};

RaySpace make_ray_space(Ray ray, Ray given) {
  vec3 d = ray.dir, a = abs(d);
  bool x = a.x >= a.y && a.x >= a.z, y = !x && a.y >= a.z;
  uint reach = floatBitsToUint(scene_reach(ray.origin)) >> 23;
  float scale = uintBitsToFloat((clamp(314u, reach + 1u, reach + 253u) - reach) << 23);  // 2^(60 - exponent of reach)
  precise float inv = 1.0 / (x ? d.x : y ? d.y : d.z);
  precise float first = -(x ? d.y : y ? d.z : d.x) * inv * scale, second = -(x ? d.z : y ? d.x : d.y) * inv * scale;
  if (x) return RaySpace(vec3(first, scale, 0.0), vec3(second, 0.0, scale), vec3(inv, 0.0, 0.0));
  if (y) return RaySpace(vec3(0.0, first, scale), vec3(scale, second, 0.0), vec3(0.0, inv, 0.0));
  return RaySpace(vec3(scale, 0.0, first), vec3(0.0, scale, second), vec3(0.0, 0.0, inv));
}

#include "leaf_vertices.glsl"
#include "nearer.glsl"
#include "products.glsl"

// A row holds at most two numbers besides zero, so at most one product and the sum are rounded, or the sum alone.
float along(vec3 row, vec3 p) {
#if BALLOT_PRODUCTS == PRODUCTS_FMA
  precise float sum = fma(row.x, p.x, fma(row.y, p.y, row.z * p.z));
#else
  precise float sum = row.x * p.x + row.y * p.y + row.z * p.z;
#endif
  return sum;
}

bool hit_triangle(Ray ray, inout RaySpace space, TriangleTexels triangle, out float t, out float u, out float v) {
  Corners corners = corners_of(triangle);
  precise vec3 a = corners.v0 - ray.origin, b = corners.v1 - ray.origin, c = corners.v2 - ray.origin;
  precise float ax = along(space.row_x, a), ay = along(space.row_y, a), az = along(space.row_z, a);
  precise float bx = along(space.row_x, b), by = along(space.row_y, b), bz = along(space.row_z, b);
  precise float cx = along(space.row_x, c), cy = along(space.row_y, c), cz = along(space.row_z, c);
  float e0 = difference_of_products(cx, by, cy, bx), e1 = difference_of_products(ax, cy, ay, cx),
        e2 = difference_of_products(bx, ay, by, ax);
  precise float det = e0 + e1 + e2;
  precise float inv = 1.0 / det;
  u = e1 * inv;
  v = e2 * inv;
  precise float depth = e0 * inv * az + u * bz + v * cz;
  t = depth;
  bool inside = min(e0, min(e1, e2)) >= 0.0 || max(e0, max(e1, e2)) <= 0.0;
  return inside && det != 0.0;
}
