// One ray by itself, nodes until a leaf, then leaves until a node: the method "while-while", and what packets fall back on.
uint traverse(inout Walker w, bool live, uint node) {
  STACK_DECLARE
  uint top = 0u;
  STACK_AT(top++) = END_OF_TREE;
  if (!live) node = END_OF_TREE;
  WALK_WHILE_WHILE(w, node, top)
  return node;
}
