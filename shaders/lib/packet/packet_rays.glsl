// The rays of a packet with BALLOT_RAYS rays in every lane: their state, and the tests of all of them against a box, a
// leaf and a hit. Loops over a lane's rays are unrolled, so that rays stay in registers. Needs subgroup-uniform control
// flow.

Walker packet[BALLOT_RAYS];  // with mirrored slabs
uint alive;              // a bit for each of this lane's rays that still looks for a hit
bvec3 packet_down;       // axes along which these rays go down; the packet walks the tree mirrored along them
uint packet_order;       // texel_order() of these rays

#define EACH_RAY(r) [[unroll]] for (uint r = 0u; r < BALLOT_RAYS; ++r)

// Returns the bounds of the live rays of the packet.
PacketBounds packet_bounds() {
  PacketBounds p = empty_bounds();
  EACH_RAY(r) {
    PacketBounds wider = p;
    widen_bounds(wider, packet[r]);
    if ((alive >> r & 1u) != 0u) p = wider;
  }
  share_bounds(p);
  return p;
}

// Returns a t that no hit of the packet is beyond.
float packet_reach() {
  float most = -LARGEST;
  EACH_RAY(r) {
    float t = reach(packet[r].space, packet[r].hit);
    most = (alive >> r & 1u) != 0u ? larger(most, t) : most;
  }
  return lanes_max(most);
}

// Returns true if some ray of the packet still looks for a hit.
bool packet_looks() { return lanes_any(alive); }

// Returns a bit for each of this lane's rays that meet the box. The box is mirrored.
uint rays_that_meet(vec3 lo, vec3 hi) {
  uint met = 0u;
  EACH_RAY(r) {
    vec2 i = forward_interval(packet[r].slabs, lo, hi, packet[r].ray.t_min, reach(packet[r].space, packet[r].hit));
    met |= uint(i.x <= i.y) << r;
  }
  return met & alive;
}

// Returns true if a hit replaces the ray's hit so far: may_count() and nearer() combined, with as few comparisons as
// possible.
bool replaces(uint r, float t, uint place) {
#ifdef TRIANGLE_SETTLES
  return may_count(packet[r].space, t, packet[r].ray, packet[r].hit) &&
         nearer(packet[r].space, t, place, packet[r].hit);
#elif BALLOT_ANY_HIT
  return t >= packet[r].ray.t_min && t <= packet[r].hit.t;
#else
  return t >= packet[r].ray.t_min && nearer(packet[r].space, t, place, packet[r].hit);
#endif
}

// Branches over code that no lane wants. Some devices only mask such code, and then the branch is a loss. All lanes
// must agree on the bits, so that none diverge here.
#if BALLOT_JUMP
#define WHERE(bits, r) if (((bits) >> (r) & 1u) != 0u)
#else
#define WHERE(bits, r)
#endif

// Tests a triangle against the rays whose bit is set in `rays`. `anyone` has the bits of all lanes.
void consider_triangle(TriangleTexels triangle, uint place, uint rays, uint anyone) {
  EACH_RAY(r) {
    WHERE(anyone, r) {
      float t, u, v;
      bool hit = hit_triangle(packet[r].ray, packet[r].space, triangle, t, u, v);
      Hit old = packet[r].hit;
      hit = hit && (rays >> r & 1u) != 0u && replaces(r, t, place);
      packet[r].hit = Hit(hit ? t : old.t, hit ? place : old.prim, hit ? u : old.u, hit ? v : old.v);
    }
  }
}

// Tests the triangles of a leaf against the rays that meet it: a bit each in `rays` for this lane, in `anyone` for all
// lanes. Lane i loads triangle i, in the packet's texel order, and hands it round.
void visit_packet_leaf(uint leaf, uint rays, uint anyone) {
  uint block = leaf & LEAF_TEXEL_MASK, count = (leaf >> LEAF_COUNT_SHIFT & 7u) + 1u;
  COUNT_WIDE_TRIANGLES(alive, rays, count)
  uint first = 0u;
  do {
    uint mine = min(first + gl_SubgroupInvocationID, count - 1u);
    TriangleTexels own = fetch_triangle(block + LEAF_HEADER_TEXELS + mine * TRIANGLE_TEXELS, packet_order);
    uint place = triangle_place(own, block, mine);
    uint end = min(count - first, SUBGROUP_SIZE), i = 0u;
    do {
      TriangleTexels triangle = TriangleTexels(subgroupShuffle(own.a, i), subgroupShuffle(own.b, i),
                                               subgroupShuffle(own.c, i), subgroupShuffle(own.at, i));
      consider_triangle(triangle, subgroupShuffle(place, i), rays, anyone);
      ++i;
    } while (i < end);
    first += SUBGROUP_SIZE;
  } while (SUBGROUP_SIZE < MAX_LEAF_TRIANGLES && first < count);
#ifdef TRIANGLE_SETTLES
  EACH_RAY(r) {
    if (BALLOT_RAYS > 1) change_ray();
    if ((alive >> r & 1u) == 0u) packet[r].space.marked = 0u;
    settle_leaf(packet[r].space, packet[r].hit);
  }
#endif
#if BALLOT_ANY_HIT
  EACH_RAY(r) alive &= ~(uint(packet[r].hit.prim != NO_HIT) << r);
#endif
}
