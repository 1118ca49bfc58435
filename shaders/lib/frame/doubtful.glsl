// Rays in doubt. In mode "exact" nearly all rays are decided by float32 and double. A kernel with DOUBTFUL_LISTED does
// no more, and lists the rays whose hit is still open; one with DOUBTFUL_LIMITED lists the rays that would need many
// decisions without rounding. A kernel with DOUBTFUL_TAKEN then traces the rays of that list, and decides without
// rounding (lib/numeric/exact_decision.glsl). It is of the same method, but while-while's where lanes vote on a common
// path: they would wait for each other's decisions. What lists gain is in tools/measured/traversal.md.
#define BALLOT_LISTS_RAYS (BALLOT_DOUBTFUL == DOUBTFUL_LISTED || BALLOT_DOUBTFUL == DOUBTFUL_LIMITED)
#if BALLOT_LISTS_RAYS
layout(set = 0, binding = BIND_DOUBTFUL, scalar) buffer Doubtful {
  IndirectArgs doubtful;  // of the kernel that takes the rays
  uint doubtful_rays[];
};

void list_ray(uint index) {
  uint at = atomicAdd(doubtful.count, 1u);
  doubtful_rays[at] = index;
  if (at % (gl_WorkGroupSize.x * BALLOT_RAYS) == 0u) atomicAdd(doubtful.groups_x, 1u);
}
#endif

#if BALLOT_DOUBTFUL == DOUBTFUL_TAKEN
layout(set = 0, binding = BIND_DOUBTFUL, scalar) readonly buffer Doubtful {
  IndirectArgs doubtful;
  uint doubtful_rays[];
};
#define RAY_AT(i) doubtful_rays[i]
#else
#define RAY_AT(i) (i)
#endif
