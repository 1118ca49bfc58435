// The split of a packet: the single change from shared to per-ray traversal, for methods that split for good.

// Copies the shared stack to every ray's own stack, then walks on from the current node ray by ray. The copy and what
// the ray pushes above it remain a depth-first stack, so STACK_SIZE suffices.
#define PART(w, node, live, top)                                            \
  if (node != END_OF_TREE) {                                                \
    COUNT_SWITCH(1u, stats_depth)                                           \
    COUNT_SHARED(false)                                                     \
    do {                                                                    \
      STACK_AT(top) = packet_entry(top);                                    \
      ++top;                                                                \
    } while (top < packet_top);                                             \
    if (!live) node = END_OF_TREE;                                          \
    WALK_IF_IF(w, node, top)                                                \
  }
