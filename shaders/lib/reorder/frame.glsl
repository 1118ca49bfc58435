// The frame of the kernels that reorder rays: one invocation a ray, without divergence.
#extension GL_EXT_scalar_block_layout : require
#include "../../shared/reorder.h"
#include "../../shared/render.h"
#include "../frame/records.glsl"

layout(local_size_x = REORDER_GROUP) in;
layout(push_constant, scalar) uniform Push { ReorderPush push; };

#if BALLOT_INDIRECT
layout(set = 0, binding = BIND_REORDER_ARGS, scalar) readonly buffer Args { IndirectArgs args[]; };
uint ray_count() { return min(push.count, args[push.args].count); }
#else
uint ray_count() { return push.count; }
#endif
