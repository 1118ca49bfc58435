// The frame of kernels whose text is a user's: the walk takes the ray of a call and leaves its answer here, instead of
// in buffers. lib/frame/kernel.glsl includes this file.

Ray asked_ray;
uvec4 hit_words[2];  // a hit, or a closest point

#ifdef CALLED_ACCEPT
// The user's: false leaves a hit out.
bool accept(Hit hit);
// The same for a hit whose t and prim are the walk's.
bool is_accepted(Hit hit);
#endif
