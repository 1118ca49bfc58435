// The inside test among instances: for each instance that may hold the point, the test of shaders/query/inside.comp in
// the mesh's own space.
//
// The definition. A point is inside if it is so of an odd number of instances. It is inside of an instance if its
// object-space point P'_i = (a_i0 (P_0 - t_0) + a_i1 (P_1 - t_1)) + a_i2 (P_2 - t_2) lies within the bounds of the mesh
// and the ray from P' along the mesh's x crosses the mesh an odd number of times. The map is that of rays
// (lib/tree/instances.glsl); in mode exact, too, P' is this float32 point. A closed mesh has no inside beyond its
// bounds, so only one with open edges is answered otherwise than by the ray alone.
//
// The bound. With w = 2^-24 and K = |M| |A| (engine/tree/host/instance.cpp), P' is the exact image of a point that lies
// within 5.1 w sum_j K_kj |P_j - t_j| of P along each axis k; call the length of this e. Let s be the factor by which M
// makes lengths longer at most. So by the bound of inside.comp the answer for a closed mesh is right unless P is nearer
// to its moved surface than e + 16 w s M', with M' the largest distance, in the mesh's space, of a vertex of a triangle
// that near.
//
// The boxes. If P' lies within the bounds of the mesh, the exact map puts it into the box B that instance.cpp widens,
// and there P is off by the 5.1 w sum_j K_kj |P_j - t_j| that is counted for the origin of a ray. So the box test of a
// ray at t = 0 holds P, and so do the boxes above.
#include "../tree/meshes.glsl"

// Returns true if a box of the top-level tree may hold the point.
bool may_hold(vec3 at, uvec4 lo, uvec4 hi) {
  precise vec3 to_lo = uintBitsToFloat(lo.xyz) - at, to_hi = uintBitsToFloat(hi.xyz) - at;
  vec3 far = larger(abs(to_lo), abs(to_hi));
  precise float pad = uintBitsToFloat(hi.w) * larger(larger(far.x, far.y), far.z);
  vec3 beyond = larger(to_lo - pad, -(to_hi + pad));
  return larger(larger(beyond.x, beyond.y), beyond.z) <= 0.0;
}

uint top_stack[TOP_STACK_SIZE];
uint top_height;

void begin_instances(bool live) {
  top_stack[0] = END_OF_TREE;
  top_stack[1] = live ? whole_push.root : END_OF_TREE;
  top_height = 2u;
}

// Begins with an instance. Returns the root of its mesh if the point is within the mesh's bounds, and the probe there.
uint enter_instance(vec3 at, uint number, out Probe p) {
  uint record = top_push.records + number * INSTANCE_TEXELS;
  uvec4 lo = top_texel(record + 3u), hi = top_texel(record + 4u);
  uint root = enter_mesh(lo.w);
  vec4 x = uintBitsToFloat(top_texel(record)), y = uintBitsToFloat(top_texel(record + 1u)),
       z = uintBitsToFloat(top_texel(record + 2u));
  precise vec3 from = at - vec3(x.w, y.w, z.w);
  vec3 inner = in_object(x, y, z, from);
  bool within = all(greaterThanEqual(inner, push.scene_lo)) && all(lessThanEqual(inner, push.scene_hi));
  p = make_probe(within ? inner : push.scene_lo);
  return within && may_hold(at, lo, hi) ? root : END_OF_TREE;
}

// Continues to the next instance that may hold the point. Returns the root of its mesh and the probe there; END_OF_TREE
// if there is none.
uint next_instance(vec3 at, inout Probe p) {
  uint root = END_OF_TREE, node = top_stack[--top_height];
  while (node != END_OF_TREE && root == END_OF_TREE) {
    uint popped = top_stack[top_height - 1u];
    if (is_inner(node)) {
      uvec4 a = top_texel(node), b = top_texel(node + 1u), c = top_texel(node + 2u), d = top_texel(node + 3u);
      bool l = may_hold(at, a, b), r = may_hold(at, c, d);
      top_stack[top_height] = c.w;
      top_height += uint(l && r);
      top_height -= uint(!(l || r));
      node = l ? a.w : r ? c.w : popped;
    } else {
      root = enter_instance(at, node & ~LEAF_BIT, p);
      top_height -= uint(root == END_OF_TREE);
      node = popped;
    }
  }
  return root;
}
