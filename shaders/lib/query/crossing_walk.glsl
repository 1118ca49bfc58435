// The walk for the crossings of a ray, a piece of the body of a function. It takes the walker `w`, the `scale` of t,
// and `live`, which is false for a lane without a ray. It adds crossings to `found`; `unsure` is true if rounding may
// have decided. With BALLOT_FIRST it keeps the first ones (first.glsl). With BALLOT_LISTS it lists crossings, with both
// in mode exact alone. With BALLOT_ANY it ends at one.
  bool unsure = false;
  do {
    find_leaves(w);
    uint left = 0u, texel = 0u;  // triangles of the leaf that are still to be tested, and the next one
    if (leaf_count != 0u) {
      do {
        if (left == 0u) {
          uint leaf = next_leaf();
          texel = (leaf & LEAF_TEXEL_MASK) + LEAF_HEADER_TEXELS;
          left = (leaf >> LEAF_COUNT_SHIFT & 7u) + 1u;
#if BALLOT_SHAPES
          left *= 2u;  // the ends of each span
#endif
        }
        Hit hit;
        Doubt doubt;
#ifdef CALLED_INTERSECT
        bool crossed = crosses_any(w, texel, END_OF(left), hit, doubt);
#elif BALLOT_SHAPES
        bool crossed = crosses_end(w, texel, END_OF(left), hit, doubt);
#else
        bool crossed = crosses(w, texel, hit, doubt);
#endif
#ifdef CALLED_ACCEPT
        if (crossed) crossed = accept(Hit(hit.t * scale, hit.prim, hit.u, hit.v));
#endif
#if BALLOT_FIRST && !BALLOT_EXACT
        if (crossed) take_first(hit);
        SET_REACH(w, last_first())
#elif BALLOT_FIRST
        crossed = crossed && doubt.low <= REACH;
        if (crossed) take_first(doubt.high);
        if (doubt.open) open_t = smaller(open_t, doubt.low);
        SET_REACH(w, last_first())
#else
        unsure = unsure || doubt.open;
#endif
        found += uint(crossed);
#if BALLOT_LISTS != LISTS_NONE && (!BALLOT_FIRST || BALLOT_EXACT)
        if (crossed) list(record_of(hit, scale));
#endif
#if BALLOT_SHAPES
        texel += (left & 1u) * TRIANGLE_TEXELS;
#else
        texel += TRIANGLE_TEXELS;
#endif
        --left;
#if BALLOT_ANY
        if (crossed) {
          live = false;
          left = 0u;
          end_walk();
        }
#endif
      } while (leaf_count + left != 0u);
    }
  } while (IS_UNDER_WAY(w, live));
