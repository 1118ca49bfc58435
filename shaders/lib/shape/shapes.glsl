// Shapes other than triangles: spheres, discs, capsules, boxes (shared/shapes.h). A kernel includes this file behind
// lib/tree/meshes.glsl if BALLOT_SHAPES is not 0; BALLOT_SHAPES has a bit for each kind that the scene has.
//
// A ray meets a closed shape along a span: it enters at one end and leaves at the other. Both count as hits, as for a
// closed mesh; of a disc there is one. A hit's u and v tell the outward normal, of a disc its own, by the octahedral
// map (Cigolle et al. A Survey of Efficient Representations for Independent Unit Vectors. JCGT 3(2), 2014).
//
// Error. Each shape is first taken relative to the ray's origin, as vertices of triangles are, then to the ray's point
// that is nearest to it, found twice. So the answer is that of a shape that lies elsewhere by at most 8 * 2^-24 of its
// largest distance M from the origin along an axis, whose size is off by 4 * 2^-24 of itself; t is off by 15 * 2^-24 M
// over the main component of the direction besides (tests/device/test_shapes.cpp measures both). That is within what
// boxes are padded by for triangles (lib/numeric/box_padded.glsl).
//
// Spans, feet and normals are of one file for each kind.
#include "../../shared/shapes.h"

layout(set = 0, binding = BIND_SHAPES, std430) readonly buffer Shapes { vec4 shape_texels[]; };

struct Shape {
  vec4 a, b;
};

uvec4 mesh_shape;  // of the mesh that is walked: its kind, the texel of its first record, the texels of a record

void enter_shapes(uint mesh) { mesh_shape = floatBitsToUint(shape_texels[mesh]); }

#define HAS_SHAPE(kind) ((BALLOT_SHAPES >> (kind) & 1) == 1)
#define IS_SHAPE(kind) (HAS_SHAPE(kind) && mesh_shape.x == (kind))

// Returns true if the mesh that is walked has shapes.
bool walks_shapes() {
#if HAS_SHAPE(SHAPE_TRIANGLE)
  return mesh_shape.x != SHAPE_TRIANGLE;
#else
  return true;
#endif
}

Shape fetch_shape(uint prim) {
  uint at = mesh_shape.y + prim * mesh_shape.z;
  return Shape(shape_texels[at], mesh_shape.z == 1u ? vec4(0.0) : shape_texels[at + 1u]);
}

float shape_dot(vec3 a, vec3 b) {
  precise float sum = a.x * b.x + a.y * b.y + a.z * b.z;
  return sum;
}
#define dot_of shape_dot

float length_of(vec3 v) { return sqrt(shape_dot(v, v)); }

vec3 any_across(vec3 v) {
  vec3 to = abs(v.x) > abs(v.z) ? vec3(-v.y, v.x, 0.0) : vec3(0.0, -v.z, v.y);
  return to / length_of(to);
}

float ray_over2;  // 1 / |dir|^2 of the ray that is tested

// Returns the vector from a centre to the point of the ray that is nearest to it, and the t of that point.
vec3 nearest_to(Ray ray, vec3 centre, out float t) {
  precise vec3 from = ray.origin - centre;
  precise float first = -shape_dot(from, ray.dir) * ray_over2;
  precise vec3 near = from + first * ray.dir;
  precise float second = -shape_dot(near, ray.dir) * ray_over2;
  precise vec3 nearest = near + second * ray.dir;
  precise float both = first + second;
  t = both;
  return nearest;
}

#include "sphere.glsl"
#include "disc.glsl"
#include "capsule.glsl"
#include "box.glsl"

#undef dot_of

// The octahedral map of a direction of any length, to [0, 1] x [0, 1].
vec2 octahedral_of(vec3 v) {
  vec2 p = v.xy / (abs(v.x) + abs(v.y) + abs(v.z));
  vec2 sides = vec2(p.x < 0.0 ? -1.0 : 1.0, p.y < 0.0 ? -1.0 : 1.0);
  if (v.z < 0.0) p = (1.0 - abs(p.yx)) * sides;
  precise vec2 uv = p * 0.5 + 0.5;
  return uv;
}

// Returns true if a ray meets a shape, and where it enters and leaves. Sets ray_over2, which shape_hit() needs.
bool shape_span(Shape s, Ray ray, out vec2 t) {
  ray_over2 = 1.0 / shape_dot(ray.dir, ray.dir);
#if HAS_SHAPE(SHAPE_SPHERE)
  if (IS_SHAPE(SHAPE_SPHERE)) return sphere_span(s.a, ray, t);
#endif
#if HAS_SHAPE(SHAPE_DISC)
  if (IS_SHAPE(SHAPE_DISC)) return disc_span(s, ray, t);
#endif
#if HAS_SHAPE(SHAPE_CAPSULE)
  if (IS_SHAPE(SHAPE_CAPSULE)) return capsule_span(s, ray, t);
#endif
#if HAS_SHAPE(SHAPE_BOX)
  if (IS_SHAPE(SHAPE_BOX)) return box_span(s, ray, t);
#endif
  t = vec2(0.0);
  return false;
}

// The number of hits that a ray has at most with a shape of the mesh that is walked.
uint shape_ends() { return IS_SHAPE(SHAPE_DISC) ? 1u : 2u; }

// Returns the outward normal, of any length, at an end of a ray's span: where it enters the shape (0) or leaves it (1).
// Where both ends have the same t they have one normal, so that two crossings which no order tells apart are the same.
vec3 shape_normal(Shape s, Ray ray, vec2 span, uint end) {
  bool leaves = end == 1u && span.x != span.y;
#if HAS_SHAPE(SHAPE_DISC)
  if (IS_SHAPE(SHAPE_DISC)) return s.b.xyz;
#endif
#if HAS_SHAPE(SHAPE_BOX)
  if (IS_SHAPE(SHAPE_BOX)) return box_normal(s, ray, leaves);
#endif
  float near;
  vec3 nearest = nearest_to(ray, s.a.xyz, near);
  precise vec3 at = nearest + (span[end] - near) * ray.dir;
#if HAS_SHAPE(SHAPE_CAPSULE)
  float distance;
  if (IS_SHAPE(SHAPE_CAPSULE)) return capsule_normal(s, at, distance);
#endif
  return at;
}

// Returns the vector from a point to the nearest one of a shape's surface, and the outward normal there.
vec3 shape_foot(Shape s, vec3 at, out vec3 normal) {
#if HAS_SHAPE(SHAPE_SPHERE)
  if (IS_SHAPE(SHAPE_SPHERE)) return sphere_foot(s.a, at, normal);
#endif
#if HAS_SHAPE(SHAPE_DISC)
  if (IS_SHAPE(SHAPE_DISC)) return disc_foot(s, at, normal);
#endif
#if HAS_SHAPE(SHAPE_BOX)
  if (IS_SHAPE(SHAPE_BOX)) return box_foot(s, at, normal);
#endif
  vec3 to = vec3(0.0);
#if HAS_SHAPE(SHAPE_CAPSULE)
  float distance;
  precise vec3 from = at - s.a.xyz;
  normal = capsule_normal(s, from, distance);
  to = normal * -distance;
#endif
  return to;
}
