// The reach of a ray of which the first FIRST crossings are wanted: the smallest t so far of as many.
//
// What lies farther away is not among the first: it is not listed, and boxes there are culled, whose triangles have a t
// above the reach (lib/numeric/box_padded.glsl). So the list holds the first crossings whatever the order of the walk
// and the tree, and the host puts them into order.
//
// BALLOT_EXACT: the reach is made of the largest t that crossings may have; one is listed if the smallest that it may
// have is within the reach. A ray is UNSURE if a crossing within the reach is open.
//
// BALLOT_INSTANCES: t and the reach, `best.t`, are on the scale of `world`; the walk of a mesh has the reach on its own
// scale besides. Mode exact orders crossings of two instances by t as reported, which is off by 2^-24 + 2^-30
// of it. What is left out still comes behind the first crossings: its t is not below the reach, and theirs are below it
// by more than 8 * 2^-24 of themselves (lib/query/sure.glsl takes 32 * 2^-24 of the depth and proves 23 * 2^-24).
//
// Memory FIRST words per lane
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

float first_t[FIRST];                         // in order, units of the scaled ray
float open_t = uintBitsToFloat(0x7F800000u);  // exact: a crossing that is open has no smaller t

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
