// Walks one ray by itself, inner nodes until a leaf, then leaves until an inner node. This is method "while-while", and
// the fallback of packets.
void traverse(inout Walker w, bool live, uint node) {
  STACK_DECLARE
  uint top = 0u;
  STACK_AT(top++) = END_OF_TREE;
  if (!live) node = END_OF_TREE;
  WALK_WHILE_WHILE(w, node, top)
}
