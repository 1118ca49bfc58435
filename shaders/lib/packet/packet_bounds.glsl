// Bounds of a packet: of the plane distances and reciprocal directions of all its rays. If the bounds do not meet a
// box, no ray does: subtraction and multiplication are monotone, and so is their rounding. (Rays with multiply-add,
// lib/numeric/box_fma.glsl, round in another way. They may lose boxes that they only touch, as that test does anyway.)
// lo_origin is the largest origin from which any ray measures lower planes, hi_origin the smallest for upper planes, so
// that a plane's distance is bounded on the side that counts. Slabs are mirrored (lib/numeric/numeric.glsl), so all
// directions are positive: an entry belongs to a lower plane, an exit to an upper one.
//
// After: Solomon Boulos, Ingo Wald, Peter Shirley. Geometric and Arithmetic Culling Methods for Entire Ray Packets.
// University of Utah, UUCS-06-010, 2006.

struct PacketBounds {
  vec3 lo_origin, hi_origin, inv_min, inv_max;
  float t_min;
};

// Returns bounds of no ray.
PacketBounds empty_bounds() {
  return PacketBounds(vec3(-LARGEST), vec3(LARGEST), vec3(LARGEST), vec3(-LARGEST), LARGEST);
}

// Extends the bounds by a ray.
void widen_bounds(inout PacketBounds p, Walker w) {
  vec3 lo_origin, hi_origin;
  slab_origins(w.slabs, w.ray, lo_origin, hi_origin);
  p.lo_origin = larger(p.lo_origin, lo_origin);
  p.hi_origin = smaller(p.hi_origin, hi_origin);
  p.inv_min = smaller(p.inv_min, w.slabs.inv);
  p.inv_max = larger(p.inv_max, w.slabs.inv);
  p.t_min = smaller(p.t_min, w.ray.t_min);
}

// Extends the bounds from the rays of each lane to those of the whole subgroup.
void share_bounds(inout PacketBounds p) {
  p.lo_origin = lanes_max(p.lo_origin);
  p.hi_origin = lanes_min(p.hi_origin);
  p.inv_min = lanes_min(p.inv_min);
  p.inv_max = lanes_max(p.inv_max);
  p.t_min = lanes_min(p.t_min);
}

// Returns true if a ray of the packet may meet the box before t_max. `entry` is then a lower bound of t at the entry of
// any ray.
bool packet_may_meet(PacketBounds p, vec3 lo, vec3 hi, float t_max, out float entry) {
  precise vec3 a = lo - p.lo_origin, b = hi - p.hi_origin;
  precise vec3 a_min = a * p.inv_min, a_max = a * p.inv_max, b_min = b * p.inv_min, b_max = b * p.inv_max;
  vec3 near = smaller(a_min, a_max), far = larger(b_min, b_max);
  entry = larger(larger(near.x, near.y), larger(near.z, p.t_min));
  return entry <= stretched_end(smaller(smaller(far.x, far.y), smaller(far.z, t_max)));
}
