// The slots of the children of a wide node of bvh8 (shared/layout.h): the placement that engine/tree/formats/bvh8.h
// asks for. The sum over the children of the dot product of their centres, measured from the node's, with the diagonal
// of their slot is the largest that any placement has, but for rounding. The file that includes this one includes
// members.glsl.
//
// Harold W. Kuhn. The Hungarian Method for the Assignment Problem. Naval Research Logistics Quarterly 2, 1955, as
// shortest augmenting paths: Roy Jonker, Anton Volgenant. A Shortest Augmenting Path Algorithm for Dense and Sparse
// Linear Assignment Problems. Computing 38, 1987. The host tries all sets of slots in turn instead, which takes more
// memory than a lane has registers.
const uint SLOTS = BVH8_CHILDREN;
const float FARTHEST = 3e38;

vec3 offsets[SLOTS];  // of the children's centres, doubled
// Slots and children count from 1 here. Slot 0 is where the search for the place of a child begins; child 0 is none.
uint placed[SLOTS + 1u];  // the child in each slot
float child_price[SLOTS + 1u], slot_price[SLOTS + 1u];

float loss(uint child, uint slot) {
  vec3 o = offsets[child - 1u];
  uint bits = slot - 1u;
  return ((bits & 1u) == 0u ? o.x : -o.x) + ((bits & 2u) == 0u ? o.y : -o.y) + ((bits & 4u) == 0u ? o.z : -o.z);
}

// Finds a place for one more child, where children with a place may move on to others.
void place(uint child) {
  uint from[SLOTS + 1u], reached = 0u, slot = 0u;
  float least[SLOTS + 1u];
  for (uint s = 0u; s <= SLOTS; ++s) least[s] = FARTHEST;
  placed[0] = child;
  while (placed[slot] != 0u) {  // each round reaches one more slot, and less than all are taken
    uint at = placed[slot], nearest = 0u;
    float step = FARTHEST;
    reached |= 1u << slot;
    for (uint s = 1u; s <= SLOTS; ++s) {
      if ((reached >> s & 1u) != 0u) continue;
      float price = loss(at, s) - child_price[at] - slot_price[s];
      if (price < least[s]) {
        least[s] = price;
        from[s] = slot;
      }
      if (least[s] < step) {
        step = least[s];
        nearest = s;
      }
    }
    for (uint s = 0u; s <= SLOTS; ++s) {
      if ((reached >> s & 1u) != 0u) {
        child_price[placed[s]] += step;
        slot_price[s] -= step;
      } else {
        least[s] -= step;
      }
    }
    slot = nearest;
  }
  while (slot != 0u) {
    placed[slot] = placed[from[slot]];
    slot = from[slot];
  }
}

// Returns the number of the child in each slot, counted from 1, in four bits a slot; 0: the slot is empty.
uint slots_of_members() {
  vec3 lo, hi;
  for (uint i = 0u; i < member_count; ++i) {
    Child c = read_child(texel_of(members[i] >> 1), members[i] & 1u);
    lo = i == 0u ? c.lo : min(lo, c.lo);
    hi = i == 0u ? c.hi : max(hi, c.hi);
    offsets[i] = c.lo + c.hi;
  }
  for (uint s = 0u; s <= SLOTS; ++s) {
    placed[s] = 0u;
    child_price[s] = slot_price[s] = 0.0;
  }
  for (uint i = 0u; i < member_count; ++i) offsets[i] -= lo + hi;
  for (uint child = 1u; child <= member_count; ++child) place(child);
  uint slots = 0u;
  for (uint s = 1u; s <= SLOTS; ++s) slots |= placed[s] << 4u * (s - 1u);
  return slots;
}
