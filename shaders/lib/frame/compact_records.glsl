// Records of 32 bytes that the lanes of a subgroup write one behind the other. Lane by lane each store would touch as many sectors
// of memory as two records have, and fill half of each; so on GPUs records go through shared memory first, and lanes then
// write neighbouring parts. Eye rays on an H200: 0.6 of the time. CPU devices, whose lanes write one by one anyway, have
// subgroups of at most 16.
//
// Subgroup-uniform control flow; workgroups of PUT_GROUP invocations. GL_KHR_shader_subgroup_basic and _ballot.

const uint PUT_GROUP = 64u;
shared uvec4 put_parts[2u * PUT_GROUP];

// This invocation's number, so that a subgroup's are consecutive.
uint put_index() {
  return gl_WorkGroupID.x * PUT_GROUP + gl_SubgroupID * gl_SubgroupSize + gl_SubgroupInvocationID;
}

// The records of the lanes that want it, to name[first], name[first + 1] and so on; `first` is the same in all of them.
#define PUT_RECORDS(name, first, wanted, record)                                                              \
  {                                                                                                           \
    uvec4 put_who = subgroupBallot(wanted);                                                                   \
    uint put_rank = subgroupBallotExclusiveBitCount(put_who);                                                 \
    if (gl_SubgroupSize >= 32u) {                                                                             \
      uint put_mine = 2u * gl_SubgroupID * gl_SubgroupSize, put_end = 2u * subgroupBallotBitCount(put_who);   \
      subgroupBarrier(); /* what was put before has been read */                                              \
      if (wanted) {                                                                                           \
        put_parts[put_mine + 2u * put_rank] = first_part(record);                                             \
        put_parts[put_mine + 2u * put_rank + 1u] = second_part(record);                                       \
      }                                                                                                       \
      subgroupBarrier();                                                                                      \
      for (uint put_i = gl_SubgroupInvocationID; put_i < put_end; put_i += gl_SubgroupSize)                   \
        name[2u * (first) + put_i] = put_parts[put_mine + put_i];                                             \
    } else if (wanted) {                                                                                      \
      put_record(name, (first) + put_rank, record);                                                           \
    }                                                                                                         \
  }
