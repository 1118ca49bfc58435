// The children of a wide node (collapse.glsl), found from the choices of its pairs. The file that includes this one
// includes collapse.glsl and read_pair.glsl. A member is named by its pair and side: twice the number of the pair, plus
// 1 for the right sibling.
uint ref_of(uint member) {
  uvec4 refs = pairs[texel_of(member >> 1) + 3u];
  return (member & 1u) == 0u ? refs.x : refs.y;
}

// The children from left to right, and their references.
uint members[WIDTH], member_refs[WIDTH], member_count;

// Siblings whose subtrees are still to be cut, and into how many children at most.
uint open_members[WIDTH], open_most[WIDTH], open_count;
void divide(uint pair, uint n) {
  uint left = left_of(choices[pair], n);
  open_members[open_count] = pair << 1 | 1u;
  open_most[open_count++] = n - left;
  open_members[open_count] = pair << 1;
  open_most[open_count++] = left;
}

// Finds the children of the wide node of this pair. Never more siblings are open than there are children.
void find_members(uint pair) {
  member_count = open_count = 0u;
  divide(pair, WIDTH);
  while (open_count > 0u) {
    uint member = open_members[--open_count], ref = ref_of(member), n = 1u;
    if (ref < LEAF_BIT) n = becomes(choices[pair_at(ref)], open_most[open_count]);
    if (n > 1u) {
      divide(pair_at(ref), n);
    } else if (ref != END_OF_TREE) {  // which stands beside the one leaf of a tree without other pairs
      members[member_count] = member;
      member_refs[member_count++] = ref;
    }
  }
}
