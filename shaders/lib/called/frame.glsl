// The frame of kernels whose text is a user's: the walk takes the ray of a call and leaves its answer here, instead of
// in buffers. lib/frame/kernel.glsl includes this file.

Ray asked_ray;
uvec4 hit_words[2];  // a hit, or a closest point

#if defined(CALLED_ACCEPT) || defined(CALLED_INTERSECT)
// The number in the scene of a prim of the mesh that is walked.
uint scene_prim(uint prim);
#endif

#ifdef CALLED_INTERSECT
// The user's: what a ray meets of a shape.
bool intersect(uint prim, Ray ray, inout Hit hit);
// The same for a prim of the mesh that is walked.
bool meets_shape(Ray ray, uint prim, out float t, out float u, out float v);
#endif
#ifdef CALLED_IS_SHAPE
// The user's: false for a triangle.
bool is_shape(uint prim);
#endif

#ifdef CALLED_ACCEPT
// The user's: false leaves a hit out.
bool accept(Hit hit);
// The same for a hit whose t and prim are the walk's.
bool is_accepted(Hit hit);
#endif
