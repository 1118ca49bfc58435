// The frame of methods that give new rays to idle lanes while other lanes are still at work. Such a method defines
// METHOD_REFILLS before lib/frame/kernel.glsl, and
//   begin_ray()                        empties the lane's stack
//   traverse(w, live, node) -> node    continues from node; if `refill_left`, it may return early with another node
//                                      than END_OF_TREE
//
// Source: Timo Aila, Samuli Laine, Tero Karras. Understanding the Efficiency of Ray Traversal on GPUs - Kepler and
// Fermi Addendum. NVIDIA Technical Report NVR-2012-02, 2012. ("dynamic fetch")

#if BALLOT_LAUNCH == LAUNCH_PLAIN
// A subgroup has as many rays as lanes, so no ray is left to take after the first round.
uint refill_next, refill_end;
void refill_start() {
  uint subgroup = gl_WorkGroupID.x * gl_NumSubgroups + gl_SubgroupID;
  refill_next = push.ray_begin + subgroup * gl_SubgroupSize;
  refill_end = min(RAY_END, refill_next + gl_SubgroupSize);
}
uint refill_take(uint count) {
  uint base = refill_next;
  refill_next += count;
  refill_left = refill_next < refill_end;
  return base;
}
#else
uint refill_taken, refill_end;
// Takes `count` rays from the counter, and returns the first. The dispatch is bounded: once a subgroup has taken
// max_batches times its size, it takes no more.
uint take_from_counter(uint count) {
  uint base = 0u;
  if (subgroupElect()) base = atomicAdd(work.next, count);
  refill_taken += count;
  return subgroupBroadcastFirst(base);
}
bool may_take() { return refill_taken / gl_SubgroupSize < push.max_batches; }

#if BALLOT_CLAIM > 1
// Claims rays from the counter, and gives each idle lane one of them. That is for CPUs: threads then seldom take the
// counter's cache line from each other, and neighbouring rays stay in one core's caches. A claim is a share of the rays
// that were left at the subgroup's last claim, so that threads end together (Constantine Polychronopoulos, David Kuck.
// Guided Self-Scheduling: A Practical Scheduling Scheme for Parallel Supercomputers. IEEE Transactions on Computers
// C-36(12), 1987). The last claim may exceed max_batches.
uint claimed_next;
void refill_start() {
  refill_taken = 0u;
  claimed_next = refill_end = push.ray_begin;
}
uint refill_take(uint count) {
  if (claimed_next >= refill_end) {
    uint claim = min(max((RAY_END - refill_end) / 64u, gl_SubgroupSize), uint(BALLOT_CLAIM));
    claimed_next = may_take() ? take_from_counter(claim) : RAY_END;
    refill_end = min(claimed_next + claim, RAY_END);
  }
  uint base = claimed_next;
  claimed_next += count;
  refill_left = claimed_next < refill_end || (refill_end < RAY_END && may_take());
  return base;
}
#else
void refill_start() {
  refill_taken = 0u;
  refill_end = RAY_END;
}
uint refill_take(uint count) {
  if (!may_take()) {
    refill_left = false;
    return refill_end;
  }
  uint base = take_from_counter(count);
  refill_left = base + count < refill_end && may_take();
  return base;
}
#endif
#endif

// Traces rays until none is left. The loop is uniform: it ends for all lanes of a subgroup at once.
void trace_rays() {
  Walker w;
  uint index = RAY_END, node = END_OF_TREE;  // index: the lane's ray, or RAY_END if it has none
  bool any_left = true;
  take_ray(index, w);
  refill_start();
  refill_left = true;
  while (any_left) {
    bool idle = node == END_OF_TREE;
#if BALLOT_INSTANCES
    if (idle && index < RAY_END) {
      node = continue_instances(w);
      begin_ray();
      idle = node == END_OF_TREE;
      if (idle) write_found(index);
    }
#else
    if (idle && index < RAY_END) write_hit(index, w);
#endif
    if (refill_left) {
      uvec4 idlers = subgroupBallot(idle);
      uint base = refill_take(subgroupBallotBitCount(idlers));
      if (idle) {
        uint mine = base + subgroupBallotExclusiveBitCount(idlers);
        index = mine < refill_end ? mine : RAY_END;
#if BALLOT_INSTANCES
        node = take_instances(index, w);
#else
        bool live = take_ray(index, w);
        COUNT_FETCH(subgroupBallotBitCount(idlers) < gl_SubgroupSize)
        node = live ? push.root : END_OF_TREE;
#endif
        begin_ray();
      }
    } else if (idle) {
      index = RAY_END;
    }
    node = traverse(w, node != END_OF_TREE, node);
    any_left = subgroupAny(index < RAY_END);
  }
  // Reached with a ray only if the driver cut the loop short.
#if BALLOT_INSTANCES
  if (index < RAY_END) write_found(index);
#else
  if (index < RAY_END) write_hit(index, w);
#endif
}
