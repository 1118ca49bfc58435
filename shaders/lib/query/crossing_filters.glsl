// What leaves out a crossing, a piece of the body of a function: it takes the `hit`, and whether the ray comes from its
// `front`, and makes `crossed` false.
#if BALLOT_CULL == CULL_BACK
  crossed = crossed && front;
#elif BALLOT_CULL == CULL_FRONT
  crossed = crossed && !front;
#endif
#if BALLOT_FILTERS
  if (crossed) crossed = !is_left_out(hit.prim);
#endif
#if BALLOT_ALPHA
  if (crossed) {
    AT_TRIANGLE(hit.prim)
#if BALLOT_HAS_SHAPES
    Hit seen = hit;
    WEIGHTS_OF_VERTICES(seen)
    crossed = opacity(material_of(hit.prim), seen) > 0.0;
#else
    crossed = opacity(material_of(hit.prim), hit) > 0.0;
#endif
  }
#endif
