// Merges the clusters of a range of keys. A subgroup does so together: its items lie in shared memory, twice, and each
// round of merges copies them from one half to the other.
//
// Daniel Meister, Jiri Bittner. Parallel Locally-Ordered Clustering for Bounding Volume Hierarchy Construction. IEEE
// TVCG 2018; Carsten Benthin et al. PLOC++. HPG 2022. Differs: distances that are equal are ordered by the exclusive or
// of the two places, so each item has one nearest neighbour, and the nearest pair of all is always mutual. Equal boxes
// then make a balanced tree.

const uint STRIDE = GROUP_SUBGROUPS * 2u * BUILD_ITEMS;
const uint STEPS = SUBGROUP_SIZE < BUILD_ITEMS ? BUILD_ITEMS / SUBGROUP_SIZE : 1u;
shared float item_floats[7u * STRIDE];  // lo, hi, cost
shared uint item_words[4u * STRIDE];    // cluster, key, sides
shared uint nearest[GROUP_SUBGROUPS * BUILD_ITEMS];

uint items_at;  // of this subgroup in the arrays above
uint nearest_at;

void begin_items() {
  items_at = gl_SubgroupID * 2u * BUILD_ITEMS;
  nearest_at = gl_SubgroupID * BUILD_ITEMS;
}

void put_item(uint at, Item item) {
  at += items_at;
  for (uint k = 0u; k < 3u; ++k) {
    item_floats[k * STRIDE + at] = item.lo[k];
    item_floats[(3u + k) * STRIDE + at] = item.hi[k];
  }
  item_floats[6u * STRIDE + at] = item.cost;
  item_words[at] = item.cluster;
  item_words[STRIDE + at] = item.key;
  item_words[2u * STRIDE + at] = item.sides_xy;
  item_words[3u * STRIDE + at] = item.side_z_shape;
}

void get_box(uint at, out vec3 lo, out vec3 hi) {
  at += items_at;
  lo = vec3(item_floats[at], item_floats[STRIDE + at], item_floats[2u * STRIDE + at]);
  hi = vec3(item_floats[3u * STRIDE + at], item_floats[4u * STRIDE + at], item_floats[5u * STRIDE + at]);
}

Item get_item(uint at) {
  Item item;
  get_box(at, item.lo, item.hi);
  at += items_at;
  item.cost = item_floats[6u * STRIDE + at];
  item.cluster = item_words[at];
  item.key = item_words[STRIDE + at];
  item.sides_xy = item_words[2u * STRIDE + at];
  item.side_z_shape = item_words[3u * STRIDE + at];
  return item;
}

// The lowest bits of a distance hold the exclusive or of the places of the two items.
const uint PLACE_BITS = BUILD_ITEMS - 1u;

// Compares the item at `place`, whose box is given, with another one.
#define NEARER(other)                                                                                      \
  {                                                                                                        \
    vec3 other_lo, other_hi;                                                                               \
    get_box(from + other, other_lo, other_hi);                                                             \
    float area = half_area(min(lo, other_lo), max(hi, other_hi));                                          \
    best = min(best, floatBitsToUint(area) & ~PLACE_BITS | (place ^ (other)));                             \
  }
// The loop over the neighbours is written out: some drivers count iterations, and stop all loops after some number.
#define NEARER_AT(r)                                   \
  if (place + r < count) NEARER(place + r)             \
  if (place >= r) NEARER(place - r)

void find_nearest(uint from, uint count) {
  for (uint place = gl_SubgroupInvocationID; place < count; place += SUBGROUP_SIZE) {
    vec3 lo, hi;
    get_box(from + place, lo, hi);
    uint best = 0xFFFFFFFFu;
    NEARER_AT(1u) NEARER_AT(2u) NEARER_AT(3u) NEARER_AT(4u) NEARER_AT(5u) NEARER_AT(6u) NEARER_AT(7u) NEARER_AT(8u)
    nearest[nearest_at + place] = best & PLACE_BITS;
  }
}

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
    uint offset = live ? nearest[nearest_at + place] : 0u, other = place ^ offset;
    bool mutual = live && nearest[nearest_at + other] == offset;
    firsts |= places_of(subgroupBallot(mutual && place < other), step);
    seconds |= places_of(subgroupBallot(mutual && place > other), step);
  }
  if (firsts == 0u) firsts = 1u, seconds = 2u;  // cannot happen; a round always makes progress
  uint kept = ~seconds & (count == BUILD_ITEMS ? 0xFFFFFFFFu : places_below(count));
  for (uint place = gl_SubgroupInvocationID; place < count; place += SUBGROUP_SIZE) {
    if ((kept >> place & 1u) != 0u) {
      Item item = get_item(from + place);
      uint other = seconds == 2u && firsts == 1u ? 1u : place ^ nearest[nearest_at + place];
      if ((firsts >> place & 1u) != 0u) item = merged(item, get_item(from + other));
      put_item(to + bitCount(kept & places_below(place)), item);
    }
  }
  return bitCount(kept);
}
