// The triangles of a scene, as shading and the generators of secondary rays read them: by the number that a hit has.
//
// A variant gives BALLOT_HAS_INSTANCES. 0: the triangles lie in the world. 1: each mesh is there once, in its own
// space, and instances move it. Then AT_TRIANGLE(prim) must come before anything that reads the triangle: it finds the
// instance, whose matrix vertex() and moved_normal() apply. A scene without instances has none of this code.
#ifndef BALLOT_HAS_INSTANCES
#error a variant must give BALLOT_HAS_INSTANCES (engine/render/data/scene_data.h)
#endif

// BALLOT_HAS_SHAPES: 1 if some instances have shapes other than triangles (lib/shade/shape_hit.glsl). The triangles of
// these stand in for shapes: they have their bounds.
#ifndef BALLOT_HAS_SHAPES
#error a variant must give BALLOT_HAS_SHAPES (engine/render/data/scene_data.h)
#endif

// The arrays of a scene that have texels for every triangle. BALLOT_STORED: 1 for a scene with more triangles than a
// texel buffer can hold; the arrays are then storage buffers.
#ifndef BALLOT_STORED
#error a variant must give BALLOT_STORED (engine/render/data/scene_data.h)
#endif
#if BALLOT_STORED
#define SCENE_ARRAY(name, bound) \
  layout(set = 0, binding = bound, std430) readonly buffer name##_array { uvec4 name##_texels[]; };
#define SCENE_TEXEL(name, i) name##_texels[i]
#else
#define SCENE_ARRAY(name, bound) layout(set = 0, binding = bound) uniform usamplerBuffer name;
#define SCENE_TEXEL(name, i) texelFetch(name, int(i))
#endif

SCENE_ARRAY(triangles, BIND_TRIANGLES)

#if BALLOT_HAS_INSTANCES
// The first PLACED_TEXELS texels begin with the number of instances. Then come for each (number of its first triangle,
// what to add to a triangle's number for its place in BIND_TRIANGLES, spread, 1 if it has shapes) and the three rows of
// its matrix.
layout(set = 0, binding = BIND_INSTANCES) uniform usamplerBuffer instances;

// The instance of the triangle at hand.
struct Placed {
  vec4 x, y, z;  // rows of the matrix; the last column is the translation
  uint shift;    // from the number of a hit to the triangle's place in the arrays of the scene
  float spread;  // engine/model/instances.h, rounded up
#if BALLOT_HAS_SHAPES
  bool shapes;
#endif
};
Placed placed;

// Finds the instance that a triangle belongs to: the last one that begins with it or before. Instances without
// triangles begin where the next one does.
void at_triangle(uint prim) {
  uint lo = 0u, hi = texelFetch(instances, 0).x - 1u;
  while (lo < hi) {
    uint mid = (lo + hi + 1u) / 2u;
    if (texelFetch(instances, int((mid + 1u) * PLACED_TEXELS)).x <= prim)
      lo = mid;
    else
      hi = mid - 1u;
  }
  int at = int((lo + 1u) * PLACED_TEXELS);
  uvec4 numbers = texelFetch(instances, at);
  placed.shift = numbers.y;
  placed.spread = uintBitsToFloat(numbers.z);
#if BALLOT_HAS_SHAPES
  placed.shapes = numbers.w != 0u;
#endif
  placed.x = uintBitsToFloat(texelFetch(instances, at + 1));
  placed.y = uintBitsToFloat(texelFetch(instances, at + 2));
  placed.z = uintBitsToFloat(texelFetch(instances, at + 3));
}
#define AT_TRIANGLE(prim) at_triangle(prim);
#define PLACE_OF(prim) (prim + placed.shift)

// Every operation is rounded by itself (lib/numeric/reproducible.glsl), so a vertex has the same bits on every device.
vec3 vertex(uint prim, uint corner) {
  vec3 v = uintBitsToFloat(SCENE_TEXEL(triangles, PLACE_OF(prim) * 3u + corner).xyz);
  precise vec3 at = vec3(placed.x.x * v.x + placed.x.y * v.y + placed.x.z * v.z + placed.x.w,
                         placed.y.x * v.x + placed.y.y * v.y + placed.y.z * v.z + placed.y.w,
                         placed.z.x * v.x + placed.z.y * v.y + placed.z.z * v.z + placed.z.w);
  return at;
}

// Returns the unit normal in the world, or its opposite where the matrix mirrors: smooth_normal() takes the ray's side.
// A normal moves by the inverse transpose, which is the matrix of cofactors over the determinant. The matrix is scaled
// first, because products of small entries underflow.
vec3 moved_normal(vec3 n) {
  vec3 x = placed.x.xyz, y = placed.y.xyz, z = placed.z.xyz, most = max(max(abs(x), abs(y)), abs(z));
  float scale = 1.0 / max(max(most.x, most.y), most.z);
  x *= scale, y *= scale, z *= scale;
  return normalize(vec3(dot(cross(y, z), n), dot(cross(z, x), n), dot(cross(x, y), n)));
}
#else
#define AT_TRIANGLE(prim)
#define PLACE_OF(prim) prim
vec3 vertex(uint prim, uint corner) { return uintBitsToFloat(SCENE_TEXEL(triangles, prim * 3u + corner).xyz); }
#define moved_normal(n) n
#endif

#if BALLOT_HAS_SHAPES
#include "shape_hit.glsl"
#else
#define WEIGHTS_OF_VERTICES(hit)
#endif
