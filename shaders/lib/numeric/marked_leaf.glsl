// Tests of two stages: the first, in float32, marks the triangles of a leaf that the ray may hit; the second runs over
// the marked ones after the leaf. The file that includes this one has surely_missed.glsl before it, and defines
// settle_triangle(), which makes a triangle's hit the best one if it is in range and before that. Its RaySpace has:
//   first_texel, marked   of the leaf's first marked triangle; a bit for each marked one from there on
//   reach                 t of the walked ray, not less than that of the best hit, or t_max if there is none
void settle_triangle(inout RaySpace space, uint texel, inout Hit best);

// Marks the triangle unless it is surely missed. Reports no hit yet.
bool hit_triangle(Ray ray, inout RaySpace space, TriangleTexels triangle, out float t, out float u, out float v) {
  t = u = v = 0.0;
  if (space.marked == 0u) space.first_texel = triangle.at;
  if (!surely_missed(ray, space, corners_of(triangle)))
    space.marked |= 1u << (triangle.at - space.first_texel) / TRIANGLE_TEXELS;
  return false;
}

// Decides the triangles of a leaf that hit_triangle has marked.
void settle_leaf(inout RaySpace space, inout Hit best) {
  uint open = BALLOT_ANY_HIT != 0 && best.prim != NO_HIT ? 0u : space.marked;
  while (open != 0u) {
    settle_triangle(space, space.first_texel + uint(findLSB(open)) * TRIANGLE_TEXELS, best);
    open = BALLOT_ANY_HIT != 0 && best.prim != NO_HIT ? 0u : open & (open - 1u);
  }
  space.marked = 0u;
}

// No hit counts before settle_leaf.
bool may_count(RaySpace space, float t, Ray ray, Hit best) { return false; }
bool nearer(inout RaySpace space, float t, uint prim, Hit best) { return false; }

float reach(RaySpace space, Hit best) { return space.reach; }
