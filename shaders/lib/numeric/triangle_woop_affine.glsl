// Triangle test "woop-affine": each triangle stores the affine map that takes it to the unit triangle (0,0,0) (1,0,0)
// (0,1,0). The ray is mapped and meets the plane z = 0. This takes 48 bytes a triangle and the fewest operations.
//
// Source: Sven Woop. A Ray Tracing Hardware Architecture for Dynamic Scenes. Saarland University, 2004, as used by Timo
// Aila, Samuli Laine. Understanding the Efficiency of Ray Traversal on GPUs. HPG 2009.
//
// Not watertight: neighbours see a shared edge through different maps. The map is relative to the scene's origin, so t
// loses digits for rays that start near their hit and far from that origin.
//
// A degenerate triangle has a map of zeros (LEAVES_AFFINE in shared/layout.h): its dir_z is 0, which is no hit.

struct RaySpace {
  uint unused;
};

RaySpace make_ray_space(inout Ray ray, Ray given) { return RaySpace(0u); }
uint texel_order(RaySpace space) { return AS_STORED; }

// Returns the prim of the i-th triangle of a block. Prims lie behind the maps.
uint affine_prim(uint block, uint i) {
  uint prims = leaf_texel(block + 1u).w;
  return leaf_texel(prims + i / 4u)[i % 4u];
}

#ifdef METHOD_PACKETS
// Each lane looks up the prim of its own triangle for all rays of the packet: 1.8 to 2.1 times as fast as one look-up a
// ray (lavapipe 22.3.6).
uint triangle_place(TriangleTexels triangle, uint block, uint i) { return affine_prim(block, i); }
uint prim_at(uint place) { return place; }
#else
// The place of a hit, until the hit is written: the texel of the leaf's block and, in three bits, the triangle's number
// there.
uint triangle_place(TriangleTexels triangle, uint block, uint i) { return block << 3 | i; }
uint prim_at(uint place) { return place == NO_HIT ? NO_HIT : affine_prim(place >> 3, place & 7u); }
#endif

#include "hit_order.glsl"

bool hit_triangle(Ray ray, inout RaySpace space, TriangleTexels triangle, out float t, out float u, out float v) {
  vec4 z = uintBitsToFloat(triangle.a), x = uintBitsToFloat(triangle.b), y = uintBitsToFloat(triangle.c);
  float dir_z = dot(ray.dir, z.xyz);
  t = -(dot(ray.origin, z.xyz) + z.w) / dir_z;
  vec3 p = ray.origin + t * ray.dir;
  u = dot(p, x.xyz) + x.w;
  v = dot(p, y.xyz) + y.w;
  return dir_z != 0.0 && u >= 0.0 && v >= 0.0 && u + v <= 1.0;
}
