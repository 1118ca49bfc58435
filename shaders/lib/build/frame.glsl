// Extensions, sizes and the order of memory accesses. Every kernel of the builder includes this file first.
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_shuffle : require
#if BALLOT_UNIFORM_FLOW
#extension GL_EXT_subgroup_uniform_control_flow : require
#define BUILD_MAIN void main() [[subgroup_uniform_control_flow]]
#else
#define BUILD_MAIN void main()
#endif

#include "../../shared/build.h"

layout(local_size_x_id = BUILD_SPEC_GROUP, local_size_y = 1, local_size_z = 1) in;
layout(constant_id = BUILD_SPEC_SUBGROUP) const uint SUBGROUP_SIZE = 4;
layout(constant_id = BUILD_SPEC_GROUP_SUBGROUPS) const uint GROUP_SUBGROUPS = 8;
const uint GROUP_SIZE = SUBGROUP_SIZE * GROUP_SUBGROUPS;

// The number of this invocation in its workgroup, by subgroup and lane.
uint lane_of_group() { return gl_SubgroupID * SUBGROUP_SIZE + gl_SubgroupInvocationID; }

// subgroup_sync() orders accesses to shared memory within a subgroup. publish() makes writes to buffers visible to
// other workgroups before later accesses.
//
// The lanes of a subgroup of lavapipe run in lockstep, and its atomic operations order all accesses to memory. Version
// 22.3 takes every memory barrier of a wider scope for a barrier of the workgroup, as every version does with
// subgroupBarrier(), and loses subgroups that come to fewer of them than others.
#if BALLOT_SUBGROUP_BARRIER
void subgroup_sync() { subgroupBarrier(); }
void publish() { memoryBarrierBuffer(); }
#else
void subgroup_sync() { subgroupMemoryBarrierShared(); }
void publish() { subgroupMemoryBarrierBuffer(); }
#endif

// Returns the sum of x over the lanes up to this one. The steps are written out, as in lib/frame/lanes.glsl.
#define ADD_LANE_BELOW(x, step)                                                          \
  if (SUBGROUP_SIZE > step) {                                                            \
    uint below = subgroupShuffle(x, max(gl_SubgroupInvocationID, step) - step);          \
    if (gl_SubgroupInvocationID >= step) x += below;                                     \
  }
uint sum_up_to_lane(uint x) {
  ADD_LANE_BELOW(x, 1u)
  ADD_LANE_BELOW(x, 2u)
  ADD_LANE_BELOW(x, 4u)
  ADD_LANE_BELOW(x, 8u)
  ADD_LANE_BELOW(x, 16u)
  ADD_LANE_BELOW(x, 32u)
  return x;
}

shared uint subgroup_sums[GROUP_SUBGROUPS];

// Returns the sum of x over all invocations of the workgroup before this one. `total` is that of all. Every invocation
// of the workgroup must call it.
uint sum_before(uint x, out uint total) {
  uint up_to = sum_up_to_lane(x);
  if (gl_SubgroupInvocationID == SUBGROUP_SIZE - 1u) subgroup_sums[gl_SubgroupID] = up_to;
  barrier();
  uint before = 0u;
  total = 0u;
  for (uint i = 0u; i < GROUP_SUBGROUPS; ++i) {
    uint sum = subgroup_sums[i];
    if (i < gl_SubgroupID) before += sum;
    total += sum;
  }
  barrier();
  return before + up_to - x;
}
