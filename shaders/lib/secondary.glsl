// Rays that start at primary hits. A generator is one file under shaders/rays/ that includes this and defines
//
//   Ray ray_from(Surface s, uint k)    the k-th ray of a hit; directions of unit length
//
// One invocation makes one ray: ray r of the hits listed in `starts` is ray r % rays_per_hit of start r / rays_per_hit.
// Only lib/exact.glsl's arithmetic is used, so equal hits give equal rays on every device.
#include "../shared/render.h"
#include "exact.glsl"
#include "random.glsl"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { SecondaryPush push; };
layout(set = 0, binding = BIND_RAYS, scalar) writeonly buffer Rays { Ray rays[]; };
layout(set = 0, binding = BIND_HITS, scalar) readonly buffer Hits { Hit primary_hits[]; };
layout(set = 0, binding = BIND_PRIMARY, scalar) readonly buffer Primary { Ray primary_rays[]; };
layout(set = 0, binding = BIND_STARTS, scalar) readonly buffer Starts { Start starts[]; };
layout(set = 0, binding = BIND_TRIANGLES) uniform usamplerBuffer triangles;

struct Surface {
  vec3 position;
  vec3 normal;   // geometric, unit, on the side that the primary ray came from
  vec3 dir;      // of the primary ray, unit
  float offset;  // how far along the normal, or against it, an origin is off the triangle for certain
  uint pixel;    // number of the pixel; seeds random numbers
};

Ray ray_from(Surface s, uint k);

vec3 vertex(uint prim, uint corner) { return uintBitsToFloat(texelFetch(triangles, int(prim * 3u + corner)).xyz); }

const float W = 5.9604645e-8;  // 2^-24, the largest relative error of a rounding

// Of the triangle v0 v1 v2; unit.
vec3 geometric_normal(vec3 v0, vec3 v1, vec3 v2, out float slenderness) {
  precise vec3 a = v1 - v0, b = v2 - v0;
  float scale = unit_scale(max(largest(a), largest(b)));  // the products of small edges would underflow
  precise vec3 scaled_a = a * scale, scaled_b = b * scale;
  vec3 c = exact_cross(scaled_a, scaled_b);
  float c_scale = unit_scale(largest(c));
  precise vec3 scaled_c = c * c_scale;
  precise float inverse_length = exact_inverse_sqrt(exact_dot(scaled_c, scaled_c));
  precise vec3 normal = scaled_c * inverse_length;
  float l = max(largest(scaled_a), largest(scaled_b));
  precise float ratio = l * l * inverse_length * c_scale;
  slenderness = ratio;
  return normal;
}

// How far along its normal an origin must lie off its triangle, so that the ray does not find the triangle again.
//
// First, how far off the plane the point p = b0 v0 + b1 v1 + b2 v2 can be computed. After: Matt Pharr, Wenzel Jakob, Greg
// Humphreys. Physically Based Rendering, section 6.8 (gamma_n = n w / (1 - n w) bounds n roundings of w = 2^-24; bounds of
// the axes make a bound along the normal by its product with them). Per axis, with S = |b0 v0| + |b1 v1| + |b2 v2|:
//   products and two sums                                 gamma_3 S
//   b0 = 1 - b1 - b2, two roundings of at most w each     2 w |v0|
//   p + offset n, the product and the sum                 2 w S
// Here S counts twice, since the normal is rounded too: w (10 S + 2 |v0|).
//
// Second, slack for the triangle test that the ray meets, which sees the triangle from this origin: its error follows the
// triangle's size, not its coordinates. With L its extent and h = 2 A / L its height, the watertight test may place the plane
// off by some w L L / h. Measured with 86 M rays of seven scenes (reflect, refract, ao, diffuse, all views): at most
// 0.43 w L L / h, and 300 w L where h < L / 1000. Hence w L (16 + L / h), and no more than 512 w L: 2^-15 L.
float offset_bound(vec3 normal, vec3 sum, vec3 v0, vec3 v1, vec3 v2, float slenderness) {
  vec3 extent = max(max(v0, v1), v2) - min(min(v0, v1), v2);
  precise vec3 error = W * (10.0 * sum + 2.0 * abs(v0));
  precise float slack = W * largest(extent) * min(16.0 + slenderness, 512.0);
  precise float bound = exact_dot(abs(normal), error) + slack;
  return bound;
}

Surface surface_at(Start start) {
  Ray ray = primary_rays[start.ray];
  Hit hit = primary_hits[start.ray];
  vec3 v0 = vertex(hit.prim, 0u), v1 = vertex(hit.prim, 1u), v2 = vertex(hit.prim, 2u);
  precise float b0 = 1.0 - hit.u - hit.v;
  precise vec3 p0 = b0 * v0, p1 = hit.u * v1, p2 = hit.v * v2;
  precise vec3 sum = abs(p0) + abs(p1) + abs(p2);
  Surface s;
  precise vec3 position = p0 + p1 + p2;
  s.position = position;
  float slenderness;
  s.normal = geometric_normal(v0, v1, v2, slenderness);
  s.dir = exact_unit(ray.dir);
  if (exact_dot(s.normal, s.dir) > 0.0) s.normal = -s.normal;
  s.offset = offset_bound(s.normal, sum, v0, v1, v2, slenderness);
  s.pixel = start.pixel;
  return s;
}

vec3 origin_above(Surface s) {
  precise vec3 origin = s.position + s.normal * s.offset;
  return origin;
}

vec3 origin_below(Surface s) {
  precise vec3 origin = s.position - s.normal * s.offset;
  return origin;
}

// Unit direction on the normal's side, its density proportional to the cosine: Malley's method, a uniform point of the disk
// lifted onto the hemisphere.
vec3 cosine_direction(Surface s, float r1, float r2) {
  vec3 n = s.normal, a = abs(n);
  vec3 axis = a.x <= a.y && a.x <= a.z ? vec3(1.0, 0.0, 0.0) : a.y <= a.z ? vec3(0.0, 1.0, 0.0) : vec3(0.0, 0.0, 1.0);
  vec3 x = exact_unit(exact_cross(n, axis)), y = exact_cross(n, x);
  precise vec2 disk = exact_turn(r2) * exact_sqrt(r1);
  precise vec3 dir = x * disk.x + y * disk.y + n * exact_sqrt(1.0 - r1);
  return exact_unit(dir);
}

void main() {
  if (gl_GlobalInvocationID.x >= push.count) return;
  uint ray = push.first + gl_GlobalInvocationID.x;
  rays[push.offset + gl_GlobalInvocationID.x] =
      ray_from(surface_at(starts[ray / push.rays_per_hit]), ray % push.rays_per_hit);
}
