// The numeric modes: arithmetic of boxes and triangles. A new mode is one file here and one line in engine/trace/numeric.h.
//
// Every mode gives
//   RaySpace   what is computed once a ray
//   make_ray_space(ray) -> RaySpace
//   hit_triangle(ray, space, v0, v1, v2, out t, out t_error, out u, out v) -> bool
//   settle_t(inout t, t_error, interval) -> bool   whether a hit counts in a leaf whose box the ray meets in interval, and
//                                                  the t that it gets there
//   box_padding(ray) -> vec3                       see lib/box.glsl
#if BALLOT_NUMERIC == NUMERIC_WATERTIGHT
#include "numeric_watertight.glsl"
#else
#include "numeric_plain.glsl"
#endif
#include "box.glsl"
