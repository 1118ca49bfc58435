// The leaves that a ray meets, by a walk of the pair tree; with BALLOT_FIRST nearer children first. Leaves are put
// aside and tested together, so that lanes do not wait for each other at every leaf.
//
//   begin_walk(live)   begins at push.root; not live: the lane has no ray
//   find_leaves(w)     walks until the room for leaves is full, or to the end
//   next_leaf()        takes a leaf that was put aside; there are leaf_count of them
//   is_walking()       false once the walk has come to its end
//   end_walk()         ends it

// More room lets more lanes test leaves at the same time. A ray that is after its first crossing alone had better have
// it soon.
#if BALLOT_FIRST
const uint LEAF_ROOM = FIRST == 1u ? 2u : 12u;
#else
const uint LEAF_ROOM = 12u;
#endif
const uint SLOTS = STACK_SIZE + LEAF_ROOM;

uint stack[SLOTS];  // leaves lie at its other end
uint top, leaf_count, node;

// Puts a child that is met aside if it is a leaf, and on the stack if not.
#define TAKE_CHILD(child, is_met)                              \
  {                                                            \
    bool met = is_met, leaf = !is_inner(child);                \
    stack[leaf ? SLOTS - 1u - leaf_count : top] = child;       \
    top += uint(met && !leaf);                                 \
    leaf_count += uint(met && leaf);                           \
  }

void begin_walk(bool live) {
  top = leaf_count = 0u;
  stack[top++] = END_OF_TREE;
  if (live && push.root != END_OF_TREE) TAKE_CHILD(push.root, true)
  node = stack[--top];
}

bool may_step() { return is_inner(node) && leaf_count + 2u <= LEAF_ROOM; }

void find_leaves(Walker w) {
  while (may_step()) {
    Pair pair = fetch_pair(node);
    float entry_l, entry_r;
    bool l = meets(w, pair.l, entry_l), r = meets(w, pair.r, entry_r);
#if BALLOT_FIRST
    bool swap = l && r && entry_l < entry_r;  // the nearer one is taken from the stack first
    TAKE_CHILD(swap ? pair.right : pair.left, swap ? r : l)
    TAKE_CHILD(swap ? pair.left : pair.right, swap ? l : r)
#else
    TAKE_CHILD(pair.left, l)
    TAKE_CHILD(pair.right, r)
#endif
    node = stack[--top];
  }
}

uint next_leaf() { return stack[SLOTS - leaf_count--]; }

bool is_walking() { return node != END_OF_TREE; }

void end_walk() {
  node = END_OF_TREE;
  leaf_count = 0u;
}
