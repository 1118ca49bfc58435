// What per-ray methods share: the ray's own stack and one step from an inner node.
//
// The stack holds child references without distances; END_OF_TREE lies at the bottom, so a pop needs no test. A step pushes
// at most one child, so STACK_SIZE = depth of the tree + 1 can not overflow (the host sets it so: engine/trace/variant.cpp).

#if BALLOT_STACK == STACK_SHARED
shared uint ray_stacks[STACK_SIZE * gl_WorkGroupSize.x];
#define STACK_AT(i) ray_stacks[(i) * gl_WorkGroupSize.x + gl_LocalInvocationIndex]
#define STACK_DECLARE
#else
#define STACK_AT(i) stack[i]
#define STACK_DECLARE uint stack[STACK_SIZE];
#endif

// The child to enter first, or the top of the stack where the ray meets neither.
#define WALK_STEP(w, node, top)                                    \
  {                                                                \
    Pair pair = fetch_pair(node);                                  \
    float entry_l, entry_r;                                        \
    bool l = meets(w, pair.lo_l, pair.hi_l, entry_l);              \
    bool r = meets(w, pair.lo_r, pair.hi_r, entry_r);              \
    bool right_first = r && (!l || entry_r < entry_l);             \
    node = right_first ? pair.right : pair.left;                   \
    if (l && r) STACK_AT(top++) = right_first ? pair.left : pair.right; \
    if (!l && !r) node = STACK_AT(--top);                          \
  }
