// From the shared path to paths of their own, once: what methods share that part for good.

// Every ray takes a copy of the shared stack for its own; then it goes on from the node at hand by itself. The copy and what
// the ray pushes above it stay a depth-first stack, so STACK_SIZE suffices.
#define PART(w, node, live, top)                                            \
  if (node != END_OF_TREE) {                                                \
    COUNT_SWITCH(1u, stats_depth)                                           \
    COUNT_SHARED(false)                                                     \
    do {                                                                    \
      STACK_AT(top) = packet_entry(top);                                    \
      ++top;                                                                \
    } while (top < packet_top);                                             \
    packet_truncated = packet_truncated || top < packet_top;                \
    if (!live) node = END_OF_TREE;                                          \
    WALK_IF_IF(w, node, top)                                                \
  }
