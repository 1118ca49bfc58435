// Shades a single hit for a picture without secondary rays: colour by BALLOT_SHADING, distance, shading normal and
// prim. Independent of traversal.
#if !defined(BALLOT_SHADING) || !defined(BALLOT_HAS_NORMALS)
#error a shading variant must give BALLOT_SHADING and BALLOT_HAS_* (engine/render/data/scene_data.cpp)
#endif

#include "triangles.glsl"
#include "surface_material.glsl"

// Returns the unit geometric normal on the side that the ray comes from.
vec3 face_normal(vec3 v0, vec3 v1, vec3 v2, vec3 dir, out bool front) {
  vec3 n = cross(v1 - v0, v2 - v0);
  // Scaled first: the square of a small triangle's normal underflows.
  vec3 a = abs(n);
  n = normalize(n / max(max(a.x, a.y), max(a.z, 1e-37)));
  front = dot(n, dir) <= 0.0;
  return front ? n : -n;
}

// Shades a hit. The cone is the footprint of a pixel at the camera, and its growth with distance. It selects the mip
// maps; if both are 0, the finest.
FilmPixel shade_hit(Ray ray, Hit hit, float cone_width, float cone_spread) {
  FilmPixel p = FilmPixel(vec3(0.0), 0.0, 0.0, vec3(0.0), NO_HIT);
  if (hit.prim != NO_HIT) {
    AT_TRIANGLE(hit.prim)
    vec3 v0 = vertex(hit.prim, 0u), v1 = vertex(hit.prim, 1u), v2 = vertex(hit.prim, 2u), dir = normalize(ray.dir);
    bool front;
    vec3 n = face_normal(v0, v1, v2, dir, front);
#if BALLOT_HAS_SHAPES
    if (placed.shapes) {
      n = normalize(normal_of_shape(hit));
      front = dot(n, dir) <= 0.0;
      n = front ? n : -n;
    }
#endif
    WEIGHTS_OF_VERTICES(hit)
#if BALLOT_SHADING == SHADING_NORMALS
    n = smooth_normal(hit, n);
    p.color = n * 0.5 + 0.5;
#else
    Look look = look_at(hit, material_of(hit.prim), v0, v1, v2, n, front, dir,
                        cone_width + cone_spread * hit.t * length(ray.dir));
    n = look.normal;
#if BALLOT_SHADING == SHADING_ALBEDO
    p.color = look.m.base_color;
#else
    p.color = look.m.base_color * abs(dot(n, dir));
#if BALLOT_HAS_UNLIT
    if ((look.m.flags & MATERIAL_UNLIT) != 0u) p.color = look.m.base_color;
#endif
#if BALLOT_HAS_EMISSION
    p.color += look.m.emissive;
#endif
#endif
#endif
    p.alpha = 1.0;
    p.z = hit.t * length(ray.dir);
    p.normal = n;
    p.prim = hit.prim;
  }
  return p;
}
