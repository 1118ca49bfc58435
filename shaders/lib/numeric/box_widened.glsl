// Box test "widened": one multiply-add a plane. The tree holds boxes that are wider than their contents, and intervals
// are stretched by a fraction of themselves, so that no box culls a triangle that the watertight test accepts.
//
// After: Thiago Ize. Robust BVH Ray Traversal. JCGT 2(2), 2013 (the stretched interval); Timo Aila, Samuli Laine.
// Understanding the Efficiency of Ray Traversal on GPUs. HPG 2009 (multiply-add). Differs: the triangle test's error is
// covered too.
//
// lib/numeric/box_padded.glsl, in contrast, widens boxes by what any ray needs for any triangle of the scene, so a ray
// that starts on a surface is inside the box of what it has just left. Most of that error goes with the distance along
// the very axis; the rest goes with the size of the triangle.
//
// The bound, with w = 2^-24 and to first order. Let an axis k be across the main axis z, S = d_k / d_z, so |S| <= 1, D
// a vertex minus the origin, and E_k the triangle's extent along k. Sheared onto the ray, the vertex lies at
// X = D_k - S D_z, rounded by w |D_k| (the subtraction) + 8 w |S D_z| (the same, the shear, its product) + w |X| (the
// sum). As |S D_z| <= |D_k| + |X|, that is at most 9 w (|D_k| + |X|). The moved triangle is hit, so |X| is at most its
// sheared extent, E_k + |S| E_z. The depth of a vertex is off by 7 w |D_z|, and the depth of the hit by 15 w |D_z| more
// (lib/numeric/triangle_watertight.glsl). This moves the point at t by |S| times that along k, and |S D_z| is bounded
// as above. Any point q of the triangle has |D_k| <= |q_k - o_k| + E_k. So the point of the unmoved triangle with the
// hit's weights, which lies in the box of some leaf, is off the point at t by at most
//   31 w |q_k - o_k| + 18 w E_k + 31 w E_z       along k, and by
//   22 w |q_z - o_z| + 22 w E_z                  along the main axis.
// The slab test of a box with centre c and half extent e moves a plane by 5 w (division) and 3 w (sums) of its
// distance, and by w (2 |c_k| + 3 e_k) (the products with origin and centre, which cancel, and with the half extent).
// If boxes are measured from a point other than zero, the origin is off by w of itself, that is by w of the plane's
// distance and w (|c_k| + e_k). Hence
//   boxes are widened by w (18 E_k + 31 E + 2 |c_k| + 3 e_k), where E is the longest extent, and by w (|c_k| + e_k)
//   more if they are measured from a point other than zero (engine/tree/host/padding.cpp);
//   t of a hit lies between entry - 40 w |entry| and exit + 40 w |exit|;
//   the end of the interval, at the exit or the nearest hit, is stretched by 96 w of itself, and both ends of the
//   interval of a beam of rays by 48 w (lib/tree/frontier.glsl), so that what is entered later may still hold the hit.
// So hits depend neither on the order of the walk nor on the tree.
//
// Far rays. Directions are clamped (box.glsl), which moves the ray by 2^-59 of its distance from the scene. So boxes
// are wider by 2^-35 of the scene's longest side, and rays from 2^22 longest sides away, whose products might overflow
// besides, meet every box. Rays that start within 2^21 longest sides of the point that boxes are measured from are
// nearer than that, because the scene lies within 17 longest sides of that point (engine/tree/host/box_origin.cpp).

const float END_SLACK = 5.73e-6, BEAM_SLACK = 2.87e-6;

struct Slabs {
  vec3 scaled_origin, inv;  // origin * inv
};

// Returns the slabs of rays from too far away: they meet every box, in [t_min, t_min], which lies in any range.
Slabs slabs_of_every_box(float t_min) { return Slabs(vec3(-t_min), vec3(0.0)); }

Slabs make_slabs(Ray ray) {
  vec3 inv = reciprocal_direction(ray.dir);
  precise vec3 scaled_origin = from_box_origin(ray.origin) * inv;
  Slabs s = Slabs(scaled_origin, inv);
  if (!(box_reach(ray.origin) <= push.padded_reach)) s = slabs_of_every_box(ray.t_min);
  return s;
}

bool has_slabs(Slabs s) { return s.inv.x != 0.0; }

// Bounds of many rays subtract first, with an error of 7 w of the distance, and stretch intervals as well.
void slab_origins(Slabs s, Ray ray, out vec3 lo, out vec3 hi) { lo = hi = from_box_origin(ray.origin); }

// Returns the padding of a ray segment for the rounding of its ends, and for the error that goes with the distance.
vec3 segment_pad(Ray ray) {
  return 2.4e-7 * abs(from_box_origin(ray.origin)) + 2.4e-6 * max(abs(ray.t_min), abs(ray.t_max)) * abs(ray.dir);
}

void first_planes(Slabs s, vec3 at, vec3 step, out vec3 near, out vec3 far) {
  precise vec3 t = fma(at, s.inv, -s.scaled_origin);
  near = far = t;
}

// Returns the interval with its end stretched.
vec2 stretched(vec3 near, vec3 far, float t_min, float t_max) {
  float end = smaller(first_exit(far), t_max);
  return vec2(larger(last_entry(near), t_min), fma(abs(end), END_SLACK, end));
}

vec2 box_interval(Slabs s, vec3 lo, vec3 hi, float t_min, float t_max) {
  vec3 a = fma(lo, s.inv, -s.scaled_origin), b = fma(hi, s.inv, -s.scaled_origin);
  return stretched(smaller(a, b), larger(a, b), t_min, t_max);
}

vec2 centred_interval(Slabs s, vec3 centre, vec3 extent, float t_min, float t_max) {
  vec3 middle = fma(centre, s.inv, -s.scaled_origin), a = abs(s.inv);
  return stretched(fma(-extent, a, middle), fma(extent, a, middle), t_min, t_max);
}
