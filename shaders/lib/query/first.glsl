// The reach of a ray of which the first FIRST crossings are wanted: the smallest t so far of as many.
//
// What lies farther away is not among the first: it is not listed, and boxes there are culled, whose triangles have a t
// above the reach (lib/numeric/box_padded.glsl). So the list holds the first crossings whatever the order of the walk
// and the tree, and the host puts them into order.
//
// BALLOT_EXACT: the reach is made of the largest t that crossings may have; one is listed if the smallest that it may
// have is within the reach. A ray is UNSURE if a crossing within the reach is open.
//
// Memory FIRST words per lane
#extension GL_EXT_control_flow_attributes : require
layout(constant_id = SPEC_FIRST) const uint FIRST = 4;

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
