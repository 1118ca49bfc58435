// main() of the traversal kernels: subgroups take rays until none is left, walk them and write their hits. Every
// traversal kernel includes this file last.
//
// A lane's ray is its subgroup's base plus its number in the subgroup, so the rays of a packet are neighbours in the
// buffer. The pipeline has full subgroups, and the workgroup size is a multiple of the subgroup size.
//
// The reconvergence rule: a persistent subgroup loops on a base that is the same for all its lanes, and no lane leaves
// the loop or the kernel alone. A lane without a ray goes along with live = false. If the device supports it, the entry
// point declares subgroup-uniform control flow, which then guarantees that votes see all lanes.

#include "trace_ray.glsl"

#ifdef METHOD_REFILLS
#include "refill.glsl"
#else
// Traces a batch of a subgroup: a packet, or one ray a lane.
#ifdef METHOD_PACKETS
#include "main_packets.glsl"
#else
void trace_packet(uint base) { trace_ray(base + gl_SubgroupInvocationID); }
#endif

void trace_rays() {
#if BALLOT_LAUNCH == LAUNCH_PLAIN
  uint subgroup = gl_WorkGroupID.x * gl_NumSubgroups + gl_SubgroupID;
  trace_packet(push.ray_begin + subgroup * gl_SubgroupSize * BALLOT_RAYS);
#else
  for (uint batch = 0u; batch < push.max_batches; ++batch) {
    uint base = 0u;
    if (subgroupElect()) base = atomicAdd(work.next, gl_SubgroupSize * BALLOT_RAYS);
    base = subgroupBroadcastFirst(base);
    if (base >= RAY_END) break;
    trace_packet(base);
  }
#endif
}
#endif

#if BALLOT_UNIFORM_FLOW
void main() [[subgroup_uniform_control_flow]] {
#else
void main() {
#endif
#if BALLOT_INSTANCES
  push = whole_push;
#endif
#if BALLOT_DOUBTFUL == DOUBTFUL_TAKEN
  ray_end = min(push.ray_end, doubtful.count);
#elif BALLOT_INDIRECT
  ray_end = indirect[push.ray_end].count;
#endif
  trace_rays();
}
