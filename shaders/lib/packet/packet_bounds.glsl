// Bounds of a packet: of the planes' distances and reciprocal directions of all its rays. A box that the bounds do not meet is
// met by no ray: subtraction and multiplication are monotone, and so is their rounding. (Rays with multiply-add, lib/numeric/box_fma.glsl,
// round otherwise; they may lose boxes that they touch, as that test does anyway.) lo_origin is the largest that any ray
// measures lower planes from, hi_origin the smallest for upper planes, so that a plane's distance is bounded on the side that
// counts. Slabs are mirrored (lib/numeric/numeric.glsl), so all directions are positive: an entry goes with a lower plane, an exit with an
// upper one.
//
// After: Solomon Boulos, Ingo Wald, Peter Shirley. Geometric and Arithmetic Culling Methods for Entire Ray Packets. University
// of Utah, UUCS-06-010, 2006.

struct PacketBounds {
  vec3 lo_origin, hi_origin, inv_min, inv_max;
  float t_min;
};

// Bounds that any ray lies outside of.
PacketBounds empty_bounds() {
  return PacketBounds(vec3(-LARGEST), vec3(LARGEST), vec3(LARGEST), vec3(-LARGEST), LARGEST);
}

void widen_bounds(inout PacketBounds p, Walker w) {
  vec3 lo_origin, hi_origin;
  slab_origins(w.slabs, w.ray, lo_origin, hi_origin);
  p.lo_origin = larger(p.lo_origin, lo_origin);
  p.hi_origin = smaller(p.hi_origin, hi_origin);
  p.inv_min = smaller(p.inv_min, w.slabs.inv);
  p.inv_max = larger(p.inv_max, w.slabs.inv);
  p.t_min = smaller(p.t_min, w.ray.t_min);
}

// From each lane's rays to all of the subgroup.
void share_bounds(inout PacketBounds p) {
  p.lo_origin = lanes_max(p.lo_origin);
  p.hi_origin = lanes_min(p.hi_origin);
  p.inv_min = lanes_min(p.inv_min);
  p.inv_max = lanes_max(p.inv_max);
  p.t_min = lanes_min(p.t_min);
}

// Whether a ray of the packet may meet the box before t_max; if so, entry is not beyond where any does.
bool packet_may_meet(PacketBounds p, vec3 lo, vec3 hi, float t_max, out float entry) {
  precise vec3 a = lo - p.lo_origin, b = hi - p.hi_origin;
  precise vec3 a_min = a * p.inv_min, a_max = a * p.inv_max, b_min = b * p.inv_min, b_max = b * p.inv_max;
  vec3 near = smaller(a_min, a_max), far = larger(b_min, b_max);
  entry = larger(larger(near.x, near.y), larger(near.z, p.t_min));
  return entry <= smaller(smaller(far.x, far.y), smaller(far.z, t_max));
}
