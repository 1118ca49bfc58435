// The frame of methods whose packets have BALLOT_RAYS rays in every lane. Such a method defines METHOD_PACKETS before
// lib/main.glsl and
//   walk_packet() -> node           walks packet[] (lib/packet_rays.glsl); END_OF_TREE unless the driver cut it short
//   traverse(w, live, node) -> node    as other methods: one ray a lane, for packets whose rays had better go by themselves
//
// Ray r of lane i is the packet's base + r * subgroup size + i, so that a packet's rays are neighbours in the buffer.

uint packet_index(uint base, uint r) { return base + r * gl_SubgroupSize + gl_SubgroupInvocationID; }

// The octant of a ray's direction: bit 0 down along x, 1 y, 2 z.
uint octant_of(uint r) {
  bvec3 down = lessThan(packet[r].slabs.inv, vec3(0.0));
  return (down.x ? 1u : 0u) | (down.y ? 2u : 0u) | (down.z ? 4u : 0u);
}

// Octants that the packet has rays in, a bit each.
uint packet_octants() {
  uint octants = 0u;
  EACH_RAY(r) octants |= (alive >> r & 1u) != 0u ? 1u << octant_of(r) : 0u;
  return lanes_or(octants);
}

// The rays of one octant after the other. True where the driver cut a walk short.
bool walk_octants(uint octants) {
  uint living = alive;
  bool cut_short = false;
  do {
    uint octant = uint(findLSB(octants));
    alive = 0u;
    EACH_RAY(r) alive |= octant_of(r) == octant ? 1u << r : 0u;
    alive &= living;
    cut_short = walk_packet() != END_OF_TREE || packet_cut_short || cut_short;
    octants &= octants - 1u;
  } while (octants != 0u);
  return cut_short || octants != 0u;
}

#if BALLOT_FALLBACK
const uint MOST_OCTANTS = 2u;  // of a packet whose rays go together

void trace_one_by_one(uint base) {
  uint r = 0u;
  do {
    trace_ray(packet_index(base, r));
    ++r;
  } while (r < BALLOT_RAYS);
  EACH_RAY(left) if (left >= r) leave_ray(packet_index(base, left));  // where the driver cut the loop short
}
#endif

void trace_packet(uint base) {
  Units units[BALLOT_RAYS];
  alive = 0u;
  EACH_RAY(r) {
    Ray given;
    alive |= uint(take_ray(packet_index(base, r), packet[r], given)) << r;
    units[r] = units_of(given);
    COUNT_WIDE_BEGIN(r)
  }
  uint octants = packet_octants();
#if BALLOT_FALLBACK
  if (bitCount(octants) > MOST_OCTANTS) {
    trace_one_by_one(base);
    return;
  }
#endif
  bool cut_short = walk_octants(octants);
  cut_short = CUT_SHORT(cut_short);
  uint left = 0u;
  EACH_RAY(r) {
    uint index = packet_index(base, r);
    COUNT_WIDE_END(r)
    if (index < RAY_END) write_hit(index, packet[r], units[r], cut_short);
    left += uint(index < RAY_END);
  }
  if (cut_short) atomicAdd(work.unfinished, left);
}
