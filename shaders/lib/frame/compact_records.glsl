// Writes the records of 32 bytes that the lanes of a subgroup hold one behind the other. If each lane stored its own
// record, a store would touch as many sectors of memory as two records have, and fill half of each. So on GPUs records
// go through shared memory first, and lanes then write neighbouring parts. Camera rays on an H200: 0.6 of the time. CPU
// devices, whose lanes write one by one anyway, have subgroups of at most 16.
//
// Needs subgroup-uniform control flow, workgroups of PUT_GROUP invocations, and GL_KHR_shader_subgroup_basic and
// _ballot.

const uint PUT_GROUP = PASS_GROUP;
shared uvec4 put_parts[2u * PUT_GROUP];

// Returns the number of this invocation. The numbers within a subgroup are consecutive.
uint put_index() {
  return gl_WorkGroupID.x * PUT_GROUP + gl_SubgroupID * gl_SubgroupSize + gl_SubgroupInvocationID;
}

// Writes the records of the lanes for which `wanted` holds to name[first], name[first + 1] and so on. `first` is the
// same in all lanes.
#define PUT_RECORDS(name, first, wanted, record)                                                              \
  {                                                                                                           \
    uvec4 put_who = subgroupBallot(wanted);                                                                   \
    uint put_rank = subgroupBallotExclusiveBitCount(put_who);                                                 \
    if (gl_SubgroupSize >= 32u) {                                                                             \
      uint put_mine = 2u * gl_SubgroupID * gl_SubgroupSize, put_end = 2u * subgroupBallotBitCount(put_who);   \
      subgroupBarrier(); /* until the previous records have been read */                                       \
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
