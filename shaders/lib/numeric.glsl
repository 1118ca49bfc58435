// The numeric modes: arithmetic of boxes and triangles. A new mode is one file here and one line in engine/trace/numeric.h.
//
// Every mode gives
//   RaySpace   what is computed once a ray
//   make_ray_space(ray) -> RaySpace
//   hit_triangle(ray, space, v0, v1, v2, out t, out u, out v) -> bool
// and the padding of boxes, e(ray), used by lib/box.glsl.
#if BALLOT_NUMERIC == NUMERIC_WATERTIGHT
#include "numeric_watertight.glsl"
#else
#include "numeric_plain.glsl"
#endif
#include "box.glsl"
