// Slabs with padding: lower planes are measured from an origin that is moved up, upper planes from one that is moved
// down, so that boxes grow. Boxes by centre and half extents have one origin and a padding.

#if BALLOT_LAYOUT >= LAYOUT_CENTRED
struct Slabs {
  vec3 origin, inv;
  float pad;
};
#else
struct Slabs {
  vec3 lo_origin, hi_origin, inv;
};
#endif

void slab_origins(Slabs s, Ray ray, out vec3 lo, out vec3 hi) {
#if BALLOT_LAYOUT >= LAYOUT_CENTRED
  precise vec3 up = s.origin + s.pad, down = s.origin - s.pad;
  lo = up;
  hi = down;
#else
  lo = s.lo_origin;
  hi = s.hi_origin;
#endif
}

void plane_distances(Slabs s, vec3 lo, vec3 hi, out vec3 to_lo, out vec3 to_hi) {
#if BALLOT_LAYOUT >= LAYOUT_CENTRED
  precise vec3 a = (lo - (s.origin + s.pad)) * s.inv, b = (hi - (s.origin - s.pad)) * s.inv;
#else
  precise vec3 a = (lo - s.lo_origin) * s.inv, b = (hi - s.hi_origin) * s.inv;
#endif
  to_lo = a;
  to_hi = b;
}

Slabs mirrored(Slabs s, bvec3 down) {
#if BALLOT_LAYOUT >= LAYOUT_CENTRED
  return Slabs(mix(s.origin, -s.origin, down), abs(s.inv), s.pad);
#else
  return Slabs(mix(s.lo_origin, -s.hi_origin, down), mix(s.hi_origin, -s.lo_origin, down), abs(s.inv));
#endif
}
