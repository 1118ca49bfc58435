// The stack of a packet, in shared memory or spread over the registers of the lanes. Needs subgroup-uniform control
// flow.

#if BALLOT_SUBGROUP_BARRIER
#define PACKET_BARRIER() subgroupBarrier()
#else
// lavapipe runs a subgroup barrier as a workgroup barrier, and loses subgroups that have left the loop.
#define PACKET_BARRIER() subgroupMemoryBarrierShared()
#endif

// The stack holds child references, with END_OF_TREE at the bottom. STACK_SIZE as in lib/tree/walk.glsl.
uint packet_top;
#if BALLOT_PACKET_STACK == PACKET_STACK_LANES
// Entry i is word i / SUBGROUP_SIZE of lane i % SUBGROUP_SIZE.
const uint PACKET_WORDS = (STACK_SIZE + SUBGROUP_SIZE - 1u) / SUBGROUP_SIZE;
uint packet_words[PACKET_WORDS];
void packet_store(uint at, uint node) {
  for (uint i = 0u; i < PACKET_WORDS; ++i)
    packet_words[i] = i * SUBGROUP_SIZE + gl_SubgroupInvocationID == at ? node : packet_words[i];
}
uint packet_entry(uint at) {
  uint word = packet_words[0];
  for (uint i = 1u; i < PACKET_WORDS; ++i) word = at >= i * SUBGROUP_SIZE ? packet_words[i] : word;
  return subgroupShuffle(word, at % SUBGROUP_SIZE);
}
#else
shared uint packet_stacks[STACK_SIZE * GROUP_SUBGROUPS];
void packet_store(uint at, uint node) {
  if (subgroupElect()) packet_stacks[gl_SubgroupID * STACK_SIZE + at] = node;
  PACKET_BARRIER();
}
uint packet_entry(uint at) { return packet_stacks[gl_SubgroupID * STACK_SIZE + at]; }
#endif
