// The parts that per-ray walks share: the ray's own stack, a step from an inner node, and the if-if and while-while
// walks.
//
// The stack holds child references without distances. END_OF_TREE lies at the bottom, so a pop needs no test. A step
// pushes at most one child, so STACK_SIZE = depth of the tree + 1 cannot overflow (the host sets it so:
// engine/answer/variant.cpp). A method that sets nodes aside keeps up to LIST_SIZE of them below its stack, above the
// END_OF_TREE.

const uint RAY_STACK_SIZE = STACK_SIZE + LIST_SIZE;
#if BALLOT_STACK == STACK_SHARED
shared uint ray_stacks[RAY_STACK_SIZE * gl_WorkGroupSize.x];
#define STACK_AT(i) ray_stacks[(i) * gl_WorkGroupSize.x + gl_LocalInvocationIndex]
#define STACK_DECLARE
#else
#define STACK_AT(i) stack[i]
#define STACK_DECLARE uint stack[RAY_STACK_SIZE];
#endif

// An any-hit ray may as well enter the left child first.
#if BALLOT_ANY_HIT && !BALLOT_SORTED
#define RIGHT_NEARER(entry_l, entry_r) false
#else
#define RIGHT_NEARER(entry_l, entry_r) (entry_r < entry_l)
#endif

// Continues to `first`. Pushes `other` if both children are met, and pops the stack if none is.
#if BALLOT_PUSH == PUSH_ALWAYS
// Without branches. Entries beyond the top of the stack are ignored. A step that pops has pushed nothing, so it may
// read the top beforehand.
#define STACK_STEP(node, top, both, any, first, other) \
  {                                                    \
    uint popped = STACK_AT(top - 1u);                  \
    STACK_AT(top) = other;                             \
    top += uint(both);                                 \
    COUNT_STACK(top)                                   \
    top -= uint(!(any));                               \
    node = any ? first : popped;                       \
  }
#else
#define STACK_STEP(node, top, both, any, first, other) \
  {                                                    \
    node = first;                                      \
    if (both) STACK_AT(top++) = other;                 \
    COUNT_STACK(top)                                   \
    if (!(any)) node = STACK_AT(--top);                \
  }
#endif

// Continues to the nearest child that the ray meets, or pops the stack if the ray meets neither.
#define WALK_STEP(w, node, top)                                                                    \
  {                                                                                                \
    COUNT_NODE(true)                                                                               \
    Pair pair = fetch_pair(node);                                                                  \
    float entry_l, entry_r;                                                                        \
    bool l = meets(w, pair.l, entry_l);                                                            \
    bool r = meets(w, pair.r, entry_r);                                                            \
    bool right_first = r && (!l || RIGHT_NEARER(entry_l, entry_r));                                \
    uint first = right_first ? pair.right : pair.left, other = right_first ? pair.left : pair.right; \
    STACK_STEP(node, top, l && r, l || r, first, other)                                            \
  }

// Tests a leaf, then pops the stack. An any-hit ray with a hit is done.
#if BALLOT_ANY_HIT
#define WALK_LEAF(w, node, top)                                    \
  {                                                                \
    visit_leaf(w, node, true);                                     \
    node = STACK_AT(--top);                                        \
    if (HAS_ENDED(w.hit)) node = END_OF_TREE;                      \
  }
#else
#define WALK_LEAF(w, node, top)                                    \
  {                                                                \
    visit_leaf(w, node, true);                                     \
    node = STACK_AT(--top);                                        \
  }
#endif

// Tests leaves until an inner node comes up; without BALLOT_LEAF_RUN, tests one leaf. lavapipe runs the body of a loop
// once more than it loops.
#if BALLOT_LEAF_RUN
#define WALK_LEAVES(w, node, top) \
  while (!is_inner(node) && node != END_OF_TREE) WALK_LEAF(w, node, top)
#else
#define WALK_LEAVES(w, node, top) \
  if (CAME_TO_LEAF(node)) WALK_LEAF(w, node, top)
#endif

// Walks from a node until the stack is empty: inner nodes until a leaf, then leaves until an inner node.
#define WALK_WHILE_WHILE(w, node, top)                                          \
  while (node != END_OF_TREE) {                                                 \
    while (is_inner(node)) WALK_STEP(w, node, top)                              \
    WALK_LEAVES(w, node, top)                                                   \
  }

// Walks from a node until the stack is empty; each iteration handles one node or one leaf.
#define WALK_IF_IF(w, node, top)                                   \
  while (node != END_OF_TREE) {                                    \
    if (is_inner(node))                                            \
      WALK_STEP(w, node, top)                                      \
    else                                                           \
      WALK_LEAF(w, node, top)                                      \
  }
