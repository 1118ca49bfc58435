#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// Turns the ray counts of the queues into the indirect arguments of the kernels that read them, and into a report for
// the host. One invocation handles one queue. The queues are empty again afterwards.
#include "../shared/render.h"

layout(local_size_x = QUEUES) in;
layout(push_constant, scalar) uniform Push { CallPush push; };
layout(set = 0, binding = BIND_QUEUES, scalar) buffer QueueCounts { uint queues[]; };
layout(set = 0, binding = BIND_WAVE_INDIRECT, scalar) writeonly buffer Indirect { IndirectArgs indirect[]; };
layout(set = 0, binding = BIND_REPORTS, scalar) writeonly buffer Reports { uint reports[]; };

void main() {
  uint queue = gl_LocalInvocationID.x, count = queues[queue];
  queues[queue] = 0u;
  uint rays = push.trace_rays[queue];
  uint groups = count / rays + uint(count % rays != 0u);
  uint first = push.record * INDIRECT_RECORDS + queue;
  indirect[first] = IndirectArgs(min(groups, push.trace_groups[queue]), 1u, 1u, count);
  indirect[first + QUEUES] = IndirectArgs((count + PASS_GROUP - 1u) / PASS_GROUP, 1u, 1u, count);
  reports[push.record * QUEUES + queue] = count;
}
