// Drivers that cut loops short, and all that kernels do about them. Mesa 22.3's lavapipe gives all loops of an
// invocation 65 535 iterations together, then silently ends each loop after one. As the limit is for all loops
// together, a loop at the end of a walk tells whether any loop before it was cut. What such a walk has found cannot be
// trusted: it is marked and counted, and the host repeats it in smaller pieces of the tree (engine/answer/repair.h).
//
// The walk itself has only to survive: what follows a loop must not read or write out of range because the loop ended
// early. BALLOT_LOOPS_CUT is 0 for drivers that are known to run loops to their end.

// Ends walks. Returns false, and counts them as unfinished, if the driver has cut a loop of this invocation short. In a
// program's own shader nobody counts.
bool finish_walks(uint count) {
#if BALLOT_LOOPS_CUT
  uint rounds = 0u, bound = 2u + (push.ray_begin >> 31);  // 2, which no compiler knows
  while (rounds < bound) ++rounds;
#ifndef CALLED_INCLUDED
  if (rounds != bound) atomicAdd(work.unfinished, count);
#endif
  return rounds == bound;
#else
  return true;
#endif
}

// True if a loop over inner nodes came to a leaf, not to the end of the tree.
#if BALLOT_LOOPS_CUT
#define CAME_TO_LEAF(node) (!is_inner(node) && node != END_OF_TREE)
#else
#define CAME_TO_LEAF(node) (node != END_OF_TREE)
#endif
