// The first FIRST crossings of a ray so far, in order of t, at equal t of prim; and its reach, which is the t of the
// last of them. What lies farther away is not among the first, and boxes there are culled, whose triangles have a t
// above the reach (lib/numeric/box_padded.glsl). So the first crossings do not depend on the order of the walk.
//
// BALLOT_EXACT: the reach is made of the largest t that crossings may have. One is listed if the smallest that it may
// have is within the reach. So the list holds the first crossings, may hold others, and the host puts it into order. A
// ray is UNSURE if a crossing within the reach is open.
//
// BALLOT_LAST: the last crossings are the first ones of the ray turned round, which ends where it began. The arithmetic
// of crossings is the same for both but for the sign of t (lib/query/triangle_crossing.glsl), so t has the bits that it
// has in the whole list. The farthest comes first; at equal t the smallest prim.
//
// BALLOT_INSTANCES: t and the reach, `best.t`, are on the scale of `world`; the walk of a mesh has the reach on its own
// scale besides. Mode exact orders crossings of two instances by t as reported, which is off by 2^-24 + 2^-30
// of it. What is left out still comes behind the first crossings: its t is not below the reach, and theirs are below it
// by more than 8 * 2^-24 of themselves (lib/query/sure.glsl takes 32 * 2^-24 of the depth and proves 23 * 2^-24).
//
// Memory 4 FIRST words per lane; exact FIRST words
#extension GL_EXT_control_flow_attributes : require
layout(constant_id = SPEC_FIRST) const uint FIRST = 4;

#if BALLOT_INSTANCES
// Returns the factor from the scale of `world` to that of the mesh's walk: a power of two.
float object_inverse() { return uintBitsToFloat(0x7F000000u - floatBitsToUint(object_scale)); }
#define REACH best.t
#define SET_REACH(w, end)                                      \
  {                                                            \
    best.t = end;                                              \
    w.hit.t = smaller(best.t * object_inverse(), w.ray.t_max); \
  }
#else
#define REACH w.hit.t
#define SET_REACH(w, end) w.hit.t = end;
#endif

#if BALLOT_EXACT
float first_t[FIRST];                         // in order, units of the scaled ray
float open_t = uintBitsToFloat(0x7F800000u);  // a crossing that is open has no smaller t

void begin_first(float t_max) {
  [[unroll]] for (uint i = 0u; i < FIRST; ++i) first_t[i] = t_max;
}

// Takes the t of a crossing. Each place passes on the larger one of its own and of what comes.
void take_first(float t) {
  [[unroll]] for (uint i = 0u; i < FIRST; ++i) {
    float own = first_t[i];
    first_t[i] = smaller(own, t);
    t = larger(own, t);
  }
}

float last_first() { return first_t[FIRST - 1u]; }
#else
Hit first_hits[FIRST];  // in order, units of the scaled ray; places that are free have prim NO_HIT

void begin_first(float t_max) {
  [[unroll]] for (uint i = 0u; i < FIRST; ++i) first_hits[i] = Hit(t_max, NO_HIT, 0.0, 0.0);
}

// Takes a crossing. Each place passes on the later one of its own and of what comes.
void take_first(Hit hit) {
  [[unroll]] for (uint i = 0u; i < FIRST; ++i) {
    Hit own = first_hits[i];
    bool sooner = hit.t < own.t || (hit.t == own.t && hit.prim < own.prim);
    first_hits[i] = Hit(sooner ? hit.t : own.t, sooner ? hit.prim : own.prim, sooner ? hit.u : own.u,
                        sooner ? hit.v : own.v);
    hit = Hit(sooner ? own.t : hit.t, sooner ? own.prim : hit.prim, sooner ? own.u : hit.u, sooner ? own.v : hit.v);
  }
}

float last_first() { return first_hits[FIRST - 1u].t; }
#endif
