#version 460
#extension GL_EXT_scalar_block_layout : require
// Counts how many of the requested iterations of a loop the driver runs, and how many of two in a loop behind it. The
// bounds come from a buffer, so no compiler can fold the loops.
layout(local_size_x = 8) in;
layout(set = 0, binding = 0, scalar) buffer Data { uint bound, done, two, after; };

void main() {
  uint i = 0u;
  for (; i < bound; ++i)
    if (done == 0xFFFFFFFFu) break;
  uint k = 0u;
  while (k < two) ++k;
  if (gl_LocalInvocationIndex == 0u) {
    done = i;
    after = k;
  }
}
