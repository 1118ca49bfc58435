#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Primary hits to film: colour by BALLOT_SHADING, distance, shading normal, prim. Knows nothing of traversal.
#include "../shared/render.h"
#include "../lib/film.glsl"

#if !defined(BALLOT_SHADING) || !defined(BALLOT_HAS_NORMALS) || !defined(BALLOT_HAS_EMISSION)
#error a shading variant must give BALLOT_SHADING, BALLOT_HAS_NORMALS, BALLOT_HAS_EMISSION (engine/render/scene_data.cpp)
#endif

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { ShadePush push; };
layout(set = 0, binding = BIND_RAYS, scalar) readonly buffer Rays { Ray rays[]; };
layout(set = 0, binding = BIND_HITS, scalar) readonly buffer Hits { Hit hits[]; };
layout(set = 0, binding = BIND_FILM, scalar) buffer Film { FilmPixel film[]; };
layout(set = 0, binding = BIND_TRIANGLES) uniform usamplerBuffer triangles;
#if BALLOT_HAS_NORMALS
layout(set = 0, binding = BIND_NORMALS) uniform usamplerBuffer normals;
#endif
#if BALLOT_SHADING == SHADING_EYELIGHT
layout(set = 0, binding = BIND_MATERIALS, scalar) readonly buffer Materials { GpuMaterial materials[]; };
#endif

vec3 vertex(uint prim, uint corner) { return uintBitsToFloat(texelFetch(triangles, int(prim * 3u + corner)).xyz); }

// Unit, on the side that the ray comes from.
vec3 shading_normal(Hit hit, vec3 dir) {
  vec3 v0 = vertex(hit.prim, 0u);
  vec3 n = cross(vertex(hit.prim, 1u) - v0, vertex(hit.prim, 2u) - v0);
#if BALLOT_HAS_NORMALS
  vec3 n0 = uintBitsToFloat(texelFetch(normals, int(hit.prim * 3u)).xyz);
  vec3 n1 = uintBitsToFloat(texelFetch(normals, int(hit.prim * 3u + 1u)).xyz);
  vec3 n2 = uintBitsToFloat(texelFetch(normals, int(hit.prim * 3u + 2u)).xyz);
  vec3 smooth_n = n0 * (1.0 - hit.u - hit.v) + n1 * hit.u + n2 * hit.v;
  if (dot(smooth_n, smooth_n) > 1e-12) n = smooth_n;
#endif
  // Scaled first: the square of a small triangle's normal underflows.
  vec3 a = abs(n);
  n = normalize(n / max(max(a.x, a.y), max(a.z, 1e-37)));
  return dot(n, dir) > 0.0 ? -n : n;
}

void main() {
  uint index = gl_GlobalInvocationID.x;
  uvec2 pixel = pixel_of(push.first + index, push.width);
  if (index >= push.count || pixel.x >= push.width || pixel.y >= push.height) return;
  Ray ray = rays[index];
  Hit hit = hits[index];
  FilmPixel p = FilmPixel(vec3(0.0), 0.0, 0.0, vec3(0.0), NO_HIT);
  if (hit.prim != NO_HIT) {
    vec3 n = shading_normal(hit, ray.dir);
#if BALLOT_SHADING == SHADING_NORMALS
    p.color = n * 0.5 + 0.5;
#else
    GpuMaterial m = materials[texelFetch(triangles, int(hit.prim * 3u)).w];
    p.color = m.base_color * abs(dot(n, normalize(ray.dir)));
#if BALLOT_HAS_EMISSION
    p.color += m.emissive;
#endif
#endif
    p.alpha = 1.0;
    p.z = hit.t * length(ray.dir);
    p.normal = n;
    p.prim = hit.prim;
  }
  if (push.sample_index == 0u) {
    film[index] = p;
  } else {
    film[index].color += p.color;
    film[index].alpha += p.alpha;
  }
}
