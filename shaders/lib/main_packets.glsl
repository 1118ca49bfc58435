// The frame of methods whose packets have BALLOT_RAYS rays in every lane. Such a method defines METHOD_PACKETS before
// lib/main.glsl and
//   walk_packet() -> node           walks packet[] (lib/packet_rays.glsl); END_OF_TREE unless the driver cut it short
//   traverse(w, live, node) -> node    as other methods: one ray a lane, for packets whose rays had better go by themselves
//
// Ray r of lane i is the packet's base + r * subgroup size + i, so that a packet's rays are neighbours in the buffer.

uint packet_index(uint base, uint r) { return base + r * gl_SubgroupSize + gl_SubgroupInvocationID; }

#if BALLOT_FALLBACK
// Whether the directions of all rays agree in sign on every axis.
bool packet_agrees() {
  uint seen = 0u;  // bits 0..2: an axis with a positive direction; 3..5: with a negative one
  EACH_RAY(r) {
    bvec3 down = lessThan(packet[r].slabs.inv, vec3(0.0));
    uint signs = 1u << (down.x ? 3 : 0) | 1u << (down.y ? 4 : 1) | 1u << (down.z ? 5 : 2);
    seen |= (alive >> r & 1u) != 0u ? signs : 0u;
  }
  for (uint step = SUBGROUP_SIZE / 2u; step > 0u; step /= 2u) seen |= subgroupShuffleXor(seen, step);
  return (seen & seen >> 3 & 7u) == 0u;
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
#if BALLOT_FALLBACK
  if (!packet_agrees()) {
    uint r = 0u;
    do {
      trace_ray(packet_index(base, r));
      ++r;
    } while (r < BALLOT_RAYS);
    EACH_RAY(left) if (left >= r) leave_ray(packet_index(base, left));  // where the driver cut the loop short
    return;
  }
#endif
  bool cut_short = walk_packet() != END_OF_TREE || packet_cut_short;
  EACH_RAY(r) {
    uint index = packet_index(base, r);
    COUNT_WIDE_END(r)
    if (index < RAY_END) write_hit(index, packet[r], units[r], CUT_SHORT(cut_short));
  }
}
