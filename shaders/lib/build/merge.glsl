// Merges the clusters of a range of keys. A subgroup does so together: the boxes of its items lie in shared memory,
// twice, and each round of merges copies them from one half to the other. The rest of an item stays in its slot.
//
// Daniel Meister, Jiri Bittner. Parallel Locally-Ordered Clustering for Bounding Volume Hierarchy Construction. IEEE
// TVCG 2018; Carsten Benthin et al. PLOC++. HPG 2022. Differs: distances that are equal are ordered by the exclusive or
// of the two places, so each item has one nearest neighbour, and the nearest pair of all is always mutual. Equal boxes
// then make a balanced tree.

const uint STRIDE = GROUP_SUBGROUPS * 2u * BUILD_ITEMS;
const uint STEPS = SUBGROUP_SIZE < BUILD_ITEMS ? BUILD_ITEMS / SUBGROUP_SIZE : 1u;
const uint SLOTS = GROUP_SUBGROUPS * BUILD_ITEMS;
shared float item_boxes[6u * STRIDE];  // lo, hi
shared uint item_slots[STRIDE];        // where the rest of the item lies
shared float slot_costs[SLOTS];
shared uint slot_words[4u * SLOTS];    // cluster, key, sides
shared uint nearest[SLOTS];            // of each place the least distance, and to whom

uint items_at;  // of this subgroup in the arrays of boxes
uint slots_at;  // in the others

void begin_items() {
  items_at = gl_SubgroupID * 2u * BUILD_ITEMS;
  slots_at = gl_SubgroupID * BUILD_ITEMS;
}

void put_box(uint at, vec3 lo, vec3 hi, uint slot) {
  at += items_at;
  for (uint k = 0u; k < 3u; ++k) {
    item_boxes[k * STRIDE + at] = lo[k];
    item_boxes[(3u + k) * STRIDE + at] = hi[k];
  }
  item_slots[at] = slot;
}

void put_rest(uint slot, Item item) {
  slot += slots_at;
  slot_costs[slot] = item.cost;
  slot_words[slot] = item.cluster;
  slot_words[SLOTS + slot] = item.key;
  slot_words[2u * SLOTS + slot] = item.sides_xy;
  slot_words[3u * SLOTS + slot] = item.side_z_shape;
}

void get_box(uint at, out vec3 lo, out vec3 hi) {
  at += items_at;
  lo = vec3(item_boxes[at], item_boxes[STRIDE + at], item_boxes[2u * STRIDE + at]);
  hi = vec3(item_boxes[3u * STRIDE + at], item_boxes[4u * STRIDE + at], item_boxes[5u * STRIDE + at]);
}
uint slot_at(uint at) { return item_slots[items_at + at]; }

Item get_item(uint at) {
  Item item;
  get_box(at, item.lo, item.hi);
  uint slot = slots_at + slot_at(at);
  item.cost = slot_costs[slot];
  item.cluster = slot_words[slot];
  item.key = slot_words[SLOTS + slot];
  item.sides_xy = slot_words[2u * SLOTS + slot];
  item.side_z_shape = slot_words[3u * SLOTS + slot];
  return item;
}

// The lowest bits of a distance hold the exclusive or of the places of the two items, so both find the same one.
const uint PLACE_BITS = BUILD_ITEMS - 1u;

// Compares the item at `place`, whose box is given, with the one `r` places behind it, for both.
#define NEARER_AT(r)                                                                            \
  if (place + r < count) {                                                                      \
    vec3 other_lo, other_hi;                                                                    \
    get_box(from + place + r, other_lo, other_hi);                                              \
    float area = half_area(min(lo, other_lo), max(hi, other_hi));                               \
    uint distance = floatBitsToUint(area) & ~PLACE_BITS | (place ^ (place + r));                \
    best = min(best, distance);                                                                 \
    atomicMin(nearest[slots_at + place + r], distance);                                       \
  }

// The loop over the neighbours is written out: some drivers count iterations, and stop all loops after some number.
void find_nearest(uint from, uint count) {
  for (uint place = gl_SubgroupInvocationID; place < count; place += SUBGROUP_SIZE)
    nearest[slots_at + place] = 0xFFFFFFFFu;
  subgroup_sync();
  for (uint place = gl_SubgroupInvocationID; place < count; place += SUBGROUP_SIZE) {
    vec3 lo, hi;
    get_box(from + place, lo, hi);
    uint best = 0xFFFFFFFFu;
    NEARER_AT(1u) NEARER_AT(2u) NEARER_AT(3u) NEARER_AT(4u) NEARER_AT(5u) NEARER_AT(6u) NEARER_AT(7u) NEARER_AT(8u)
    atomicMin(nearest[slots_at + place], best);
  }
}
uint offset_of(uint place) { return nearest[slots_at + place] & PLACE_BITS; }

// Returns the union of two clusters and stores it as a node. The node takes the number of one of its keys, and the
// other becomes the key of the cluster. So no two nodes have the same number.
Item merged(Item a, Item b) {
  Item item;
  item.lo = min(a.lo, b.lo);
  item.hi = max(a.hi, b.hi);
  item.key = a.key;
  item.sides_xy = max_halves(a.sides_xy, b.sides_xy);
  uint side_z = max(a.side_z_shape & 0xFFFFu, b.side_z_shape & 0xFFFFu);
  uint node = b.key, triangles = count_of(a.cluster) + count_of(b.cluster), need = 0u;
  Shape s = shape_of(a.cluster, a.side_z_shape >> 16), t = shape_of(b.cluster, b.side_z_shape >> 16);
  Shape shape = Shape(1u + max(s.depth, t.depth), 1u + s.inner + t.inner, s.leaves + t.leaves);
  float area = half_area(item.lo, item.hi), as_leaf = area * push.intersection_cost * float(triangles);
  item.cost = area * push.traversal_cost + a.cost + b.cost;
  uint bits = shape.depth;
  if (triangles >= BUILD_MANY) {
    item.cluster = cluster_of(node, BUILD_MANY);
    uint small = (has_many(a.cluster) ? 0u : count_of(a.cluster)) + (has_many(b.cluster) ? 0u : count_of(b.cluster));
    need = shape.inner | shape.leaves << 8 | small << 16;
  } else {
    item.cluster = cluster_of(node, triangles);
    if (triangles <= push.max_leaf && as_leaf <= item.cost) {
      item.cluster |= BUILD_LEAF;
      item.cost = as_leaf;
      shape = LEAF_SHAPE;
    }
    bits = bits_of(shape);
  }
  item.side_z_shape = side_z | bits << 16;
  uint at = node * BUILD_NODE_TEXELS;
  nodes[at] = uvec4(floatBitsToUint(item.lo), a.cluster);
  nodes[at + 1u] = uvec4(floatBitsToUint(item.hi), b.cluster);
  nodes[at + 2u] = uvec4(floatBitsToUint(item.cost), item.key, item.sides_xy, item.side_z_shape);
  needs[node] = need;
  return item;
}

// Bits of a subgroup's lanes, moved to the places of the items of a step.
uint places_of(uvec4 lanes, uint step) { return lanes.x << (step * SUBGROUP_SIZE); }
uint places_below(uint place) { return (1u << place) - 1u; }

// Merges items that are each other's nearest. Copies all from one half to the other and returns how many there are.
uint merge_round(uint from, uint to, uint count) {
  uint firsts = 0u, seconds = 0u;
  for (uint step = 0u; step < STEPS; ++step) {
    uint place = step * SUBGROUP_SIZE + gl_SubgroupInvocationID;
    bool live = place < count;
    uint offset = live ? offset_of(place) : 0u, other = place ^ offset;
    bool mutual = live && offset_of(other) == offset;
    firsts |= places_of(subgroupBallot(mutual && place < other), step);
    seconds |= places_of(subgroupBallot(mutual && place > other), step);
  }
  if (firsts == 0u) firsts = 1u, seconds = 2u;  // cannot happen; a round always makes progress
  uint kept = ~seconds & (count == BUILD_ITEMS ? 0xFFFFFFFFu : places_below(count));
  for (uint place = gl_SubgroupInvocationID; place < count; place += SUBGROUP_SIZE) {
    if ((kept >> place & 1u) != 0u) {
      vec3 lo, hi;
      get_box(from + place, lo, hi);
      uint slot = slot_at(from + place);
      if ((firsts >> place & 1u) != 0u) {
        uint other = seconds == 2u && firsts == 1u ? 1u : place ^ offset_of(place);
        Item item = merged(get_item(from + place), get_item(from + other));
        put_rest(slot, item);
        lo = item.lo, hi = item.hi;
      }
      put_box(to + bitCount(kept & places_below(place)), lo, hi, slot);
    }
  }
  return bitCount(kept);
}
