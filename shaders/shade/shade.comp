#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Primary hits to film, the samples of a pixel in their order: colour by BALLOT_SHADING, distance, shading normal, prim. Knows
// nothing of traversal.
#include "../shared/render.h"
#include "../lib/records.glsl"
#include "../lib/film.glsl"

#if !defined(BALLOT_SHADING) || !defined(BALLOT_HAS_NORMALS)
#error a shading variant must give BALLOT_SHADING and BALLOT_HAS_* (engine/render/scene_data.cpp)
#endif

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { ShadePush push; };
RECORDS_IN(BIND_RAYS, Rays, rays)
RECORDS_IN(BIND_HITS, Hits, hits)
layout(set = 0, binding = BIND_FILM, scalar) buffer Film { FilmPixel film[]; };
layout(set = 0, binding = BIND_TRIANGLES) uniform usamplerBuffer triangles;
vec3 vertex(uint prim, uint corner) { return uintBitsToFloat(texelFetch(triangles, int(prim * 3u + corner)).xyz); }
#include "../lib/look.glsl"

// Unit, on the side that the ray comes from.
vec3 face_normal(vec3 v0, vec3 v1, vec3 v2, vec3 dir, out bool front) {
  vec3 n = cross(v1 - v0, v2 - v0);
  // Scaled first: the square of a small triangle's normal underflows.
  vec3 a = abs(n);
  n = normalize(n / max(max(a.x, a.y), max(a.z, 1e-37)));
  front = dot(n, dir) <= 0.0;
  return front ? n : -n;
}

FilmPixel shade(Ray ray, Hit hit) {
  FilmPixel p = FilmPixel(vec3(0.0), 0.0, 0.0, vec3(0.0), NO_HIT);
  if (hit.prim != NO_HIT) {
    vec3 v0 = vertex(hit.prim, 0u), v1 = vertex(hit.prim, 1u), v2 = vertex(hit.prim, 2u), dir = normalize(ray.dir);
    bool front;
    vec3 n = face_normal(v0, v1, v2, dir, front);
#if BALLOT_SHADING == SHADING_NORMALS
    n = smooth_normal(hit, n);
    p.color = n * 0.5 + 0.5;
#else
    Look look = look_at(hit, material_of(hit.prim), v0, v1, v2, n, front, dir,
                        push.cone_width + push.cone_spread * hit.t * length(ray.dir));
    n = look.normal;
    p.color = look.m.base_color * abs(dot(n, dir));
#if BALLOT_HAS_UNLIT
    if ((look.m.flags & MATERIAL_UNLIT) != 0u) p.color = look.m.base_color;
#endif
#if BALLOT_HAS_EMISSION
    p.color += look.m.emissive;
#endif
#endif
    p.alpha = 1.0;
    p.z = hit.t * length(ray.dir);
    p.normal = n;
    p.prim = hit.prim;
  }
  return p;
}

void main() {
  uint index = gl_GlobalInvocationID.x, place = push.place + index, begin = index * push.together;
  uvec2 pixel = pixel_of(push.first + index, push.width);
  if (index >= push.count || pixel.x >= push.width || pixel.y >= push.height) return;
  bool begun = push.sample_index > 0u;
  precise vec3 sum = begun ? film[place].color : vec3(0.0);
  float alpha = begun ? film[place].alpha : 0.0;
  FilmPixel first;
  uint s = 0u;
  do {
    FilmPixel p = shade(get_ray(rays, begin + s), get_hit(hits, begin + s));
    if (s == 0u) first = p;
    sum += p.color;
    alpha += p.alpha;
    ++s;
  } while (s < push.together);
  if (begun) {
    film[place].color = sum;
    film[place].alpha = alpha;
  } else {
    film[place] = FilmPixel(sum, alpha, first.z, first.normal, first.prim);
  }
}
