// Closest points among instances: a tree of instances above the trees of their meshes.
//
// The definition. Distances are the world's. The triangles are those of all instances, their corners moved to the
// world:
//   corner_i = ((m_i0 v_0 + m_i1 v_1) + m_i2 v_2) + t_i
// with m the matrix and t the translation as given, v the vertex in the mesh's space, every operation rounded to
// float32 by itself (numbers below 2^-126 may count as zero). Triangles that have no area in their mesh are left out.
// The answer is that of shaders/query/closest_point.comp for these triangles, and its bound holds with their corners.
// So it depends neither on the trees nor on the order of the walk, and where the matrix is the identity the triangles
// are the mesh's own.
//
// The walk. The nearest instance by the boxes of the top-level tree comes first; its mesh's tree is walked to its end.
// Lanes wait for each other there: 1.1 to 1.2 times as fast on lavapipe as going on by themselves, for which each step
// of all lanes would have that code (six meshes of 5 000 triangles, 20 000 points).
//
// The boxes, with w = 2^-24, to first order. Let M be the matrix, S_k = sum_j |m_kj| V_j + |t_k| with V_j the largest
// |v_j| of the mesh, S the vector of these and |S| its length, R as in closest_point.comp, of the moved corners. A
// corner lies within 4 w S_k of where the exact map puts its vertex, along each axis k.
//   The top-level tree. A box holds its meshes where exact maps put them (engine/tree/host/instance.cpp widens it
//   further).
// It is widened by 5 w S_k for the corners, with the largest S_k of all instances, and by the padding of points. The
// planes' distances and the widening round by 2 w R.
//   A mesh's tree. A box of centre c and half extents h, measured from the mesh's box origin o, is put where the map
// puts it and turned by Q, whose rows are orthonormal and make T = Q M triangular: lengths stay, and the box of a
// turned and scaled mesh is as tight as in its own space. Its centre is T c + q with q = Q (b - P), b = M o + t, and
// it reaches |T| h to each side. Rounding, in units of w: b by S_k and b - P by itself, so that, as |b - P| is at
// most sqrt(3) R + |S|, q is off by 9 R + 6 |S|; T c, whose sum of magnitudes is at most |S|, by 4 |S| and the last
// sum by 2 R; c, where it is the middle of two planes, by |S|; |T| h by 5 |S|; the widening by |S| and the last
// difference by 2 R; the corners by 4 |S|. In all 21 |S| + 13 R along each axis. Q and T are computed in double
// precision; that they are rounded is counted above. Boxes are widened by 24 w |S|, which
// engine/answer/point_instances.cpp computes, and by 144 w R instead of the 128 of lib/query/frame.glsl:
// closest_point.comp needs 111 for the triangle's distance and 4 for the sum of squares.
// What products lose below 2^-126 is less than the rest of that if R is above 2^-100.
//   Points that are `far` go without the latter. What is culled for them is then less near by 27 w R at most: as
// their M is at least 15/16 R, still below w M 64.
#include "../tree/meshes.glsl"

#if BALLOT_FETCH == FETCH_TEXEL
layout(set = 0, binding = BIND_POINT_INSTANCES) uniform usamplerBuffer point_texels;
vec4 point_texel(uint texel) { return uintBitsToFloat(texelFetch(point_texels, int(texel))); }
#else
layout(set = 0, binding = BIND_POINT_INSTANCES, std430) readonly buffer PointInstances { vec4 point_texels[]; };
vec4 point_texel(uint texel) { return point_texels[texel]; }
#endif

// The instance that is walked.
uint instance;  // its number
#ifndef RAY_INSTANCES
uint first_prim;  // the number of its first triangle
#endif
vec4 move_x, move_y, move_z;  // the rows of (M, t)
vec3 box_x;                 // the rows of T, each from its diagonal on
vec2 box_y;
float box_z;
vec3 box_from;  // q
float box_pad;

// The nodes of the top-level tree that are still to be visited.
#ifndef RAY_INSTANCES
uint top_stack[TOP_STACK_SIZE];
#endif
float top_near[TOP_STACK_SIZE];
#ifndef RAY_INSTANCES
uint top_height;
#endif

#if BALLOT_SHAPES
// The point that is asked about, in the space of the mesh, and what lengths there are multiplied by in the world. The
// matrix turns, mirrors and stretches alike along all axes: others are refused for meshes of shapes.
vec3 shape_point;
float shape_stretch;

void enter_shape_space(vec3 at) {
  vec3 column = vec3(move_x.x, move_y.x, move_z.x);
  float stretch2 = shape_dot(column, column), over = 1.0 / stretch2;
  shape_stretch = sqrt(stretch2);
  precise vec3 from = at - vec3(move_x.w, move_y.w, move_z.w);
  precise vec3 turned = vec3(move_x.x * from.x + move_y.x * from.y + move_z.x * from.z,
                             move_x.y * from.x + move_y.y * from.y + move_z.y * from.z,
                             move_x.z * from.x + move_y.z * from.y + move_z.z * from.z) * over;
  shape_point = turned;
}
#endif

// Returns the corners of a triangle in the world.
Corners moved_corners(TriangleTexels triangle) {
  vec3 x = uintBitsToFloat(triangle.a.xyz), y = uintBitsToFloat(triangle.b.xyz), z = uintBitsToFloat(triangle.c.xyz);
  precise vec3 a = move_x.x * x + move_x.y * y + move_x.z * z + move_x.w;
  precise vec3 b = move_y.x * x + move_y.y * y + move_y.z * z + move_y.w;
  precise vec3 c = move_z.x * x + move_z.y * y + move_z.z * z + move_z.w;
  return Corners(vec3(a.x, b.x, c.x), vec3(a.y, b.y, c.y), vec3(a.z, b.z, c.z));
}

// Returns for each axis of the turned space how far the probe lies outside of a node's box, which is widened.
vec3 outside_of_moved(NodeBox box) {
#if BALLOT_LAYOUT >= LAYOUT_CENTRED
  vec3 c = box.a, h = box.b;
#else
  vec3 c = box.a + box.b, h = box.b - box.a;  // doubled, as T is halved
#endif
  vec3 to = vec3(box_x.x * c.x + box_x.y * c.y + box_x.z * c.z, box_y.x * c.y + box_y.y * c.z, box_z * c.z) + box_from;
  vec3 x = abs(box_x);
  vec2 y = abs(box_y);
  vec3 half_sides = vec3(x.x * h.x + x.y * h.y + x.z * h.z, y.x * h.y + y.y * h.z, abs(box_z) * h.z);
  return larger(abs(to) - (half_sides + box_pad), vec3(0.0));
}

// Sets what the walk of an instance reads. Returns the root of its mesh.
uint enter_instance(Probe p, uint number) {
  uint record = top_push.records + number * INSTANCE_TEXELS, at = POINT_HEADER_TEXELS + number * POINT_TEXELS;
  uint root = enter_mesh(top_texel(record + 3u).w);
  instance = number;
  first_prim = top_texel(record + 5u).x;
  move_x = point_texel(at);
  move_y = point_texel(at + 1u);
  move_z = point_texel(at + 2u);
#if BALLOT_SHAPES
  if (walks_shapes()) enter_shape_space(p.at);
#endif
  vec4 x = point_texel(at + 3u), y = point_texel(at + 4u), z = point_texel(at + 5u), t = point_texel(at + 6u),
       u = point_texel(at + 7u);
  vec3 to = (vec3(x.w, y.w, z.w) - p.at) * p.scale;  // in range, as sums of three need not be
  box_from = vec3(x.x * to.x + x.y * to.y + x.z * to.z, y.x * to.x + y.y * to.y + y.z * to.z,
                  z.x * to.x + z.y * to.y + z.z * to.z) * (1.0 / p.scale);
  box_x = t.xyz;
  box_y = vec2(t.w, u.x);
  box_z = u.y;
#if BALLOT_LAYOUT < LAYOUT_CENTRED
  box_x *= 0.5;
  box_y *= 0.5;
  box_z *= 0.5;
#endif
  box_pad = u.z + 1.125 * p.pad;
  return root;
}

// Returns the squared distance, scaled, of a box of the top-level tree.
float top_distance2(Probe p, uvec4 lo, uvec4 hi, float pad) {
  vec3 out_of = larger(uintBitsToFloat(lo.xyz) - p.at, p.at - uintBitsToFloat(hi.xyz));
  vec3 d = larger(out_of - pad, vec3(0.0)) * p.scale;
  return d.x * d.x + d.y * d.y + d.z * d.z;
}

// Widens the bounds of the scene to those of all moved corners. To be called before make_probe().
void begin_scene() {
  push = whole_push;
  float pad = point_texel(0u).x;
  push.scene_lo -= pad;
  push.scene_hi += pad;
}

void begin_instances(bool live) {
  top_stack[0] = END_OF_TREE;
  top_near[0] = -1.0;
  top_stack[1] = live ? whole_push.root : END_OF_TREE;
  top_near[1] = 0.0;
  top_height = 2u;
}

#if BALLOT_FILTERS >> FILTER_GROUP
// Begins with the trees over the instances of a group and over the shared ones instead of the one over all, which lies
// above both: so the stack has room.
void begin_group(bool live, uint group, uint others) {
  top_height = 1u;
  top_stack[1] = others;
  top_near[1] = 0.0;
  top_height += uint(live && others != END_OF_TREE);
  top_stack[top_height] = group;
  top_near[top_height] = 0.0;
  top_height += uint(live && group != END_OF_TREE);
}
#endif

// Continues to the next instance whose box is no farther away than reach2, the nearest first. Returns the root of its
// mesh; END_OF_TREE if there is none.
uint next_instance(Probe p, float reach2) {
  float pad = point_texel(0u).x + 1.125 * p.pad;
  do {
    --top_height;
  } while (top_near[top_height] > reach2);
  uint node = top_stack[top_height];
  while (is_inner(node)) {
    uvec4 a = top_texel(node), b = top_texel(node + 1u), c = top_texel(node + 2u), d = top_texel(node + 3u);
    float l = top_distance2(p, a, b, pad), r = top_distance2(p, c, d, pad);
    bool right_first = r < l;
    float near = smaller(l, r), next = larger(l, r);
    bool any = near <= reach2, both = next <= reach2;
    top_stack[top_height] = right_first ? a.w : c.w;
    top_near[top_height] = next;
    top_height += uint(both);
    node = right_first ? c.w : a.w;
    if (!any) {
      do {
        --top_height;
      } while (top_near[top_height] > reach2);
      node = top_stack[top_height];
    }
  }
  return CAME_TO_LEAF(node) ? enter_instance(p, node & ~LEAF_BIT) : END_OF_TREE;
}
