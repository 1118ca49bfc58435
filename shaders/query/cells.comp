#version 460
#extension GL_GOOGLE_include_directive : require
// Cells: for each cell of a level of a grid, whether all its points are inside, or all outside, or neither is known
// because a triangle may touch it. Of a cell whose parent is not touched the parent's answer holds. One cell a lane: a
// walk of the pair tree for touching triangles, then, where none is, the walk of inside.comp from the cell's middle.
//
// Source for triangle and box: Tomas Akenine-Moeller. Fast 3D Triangle-Box Overlap Testing. Journal of Graphics Tools
// 6(1), 2001. Differs: every test is widened, so that no touching triangle is lost.
//
// Why inside.comp gives all points of a cell the same answer. Let P be such a point. inside.comp counts triangles of a
// mesh whose vertices are moved by up to w M for P, with w = 2^-24 and M their largest distance. Its answer for P is
// right for this mesh and a ray moved by an infinitesimal step, unless a triangle is within 16 w M of P. Let P go
// straight to another point of the cell, and the moved vertices with it. The parity of crossings changes only where a
// triangle passes through the point, or an edge of an odd number of triangles through the ray. The first is ruled out
// by cells that no triangle touches, the second by shadows: with each row of cells along x goes the largest x of such
// an edge in it, and a cell that does not lie beyond is taken as touched. M is at most sqrt(3) times 4.5 longest sides
// of the scene for the points that look_up.comp looks up, so 16 w M is below 2^-17 of that side. Cells are widened by
// 2^-15 of it, which covers what rounds below and in look_up.comp.
//
// The sides of inside.comp have their exact sign unless products underflow. look_up.comp leaves out points, and the
// host (engine/answer/inside_cells.cpp) scenes, with y or z that are not 0 but below 2^-60 of the longest side. So
// differences of these are 0 or have no bit below 2^-84 of it, products of two, scaled, none below 2^-94. In mode exact
// the answer is that for the mesh as it is given, and the same holds with M = 0.
//
// A walk that the driver cut short makes its cell a touched one.
#include "../lib/frame/kernel.glsl"
#include "../shared/query.h"
#include "../lib/query/frame.glsl"
#include "../lib/query/crossing.glsl"
#include "../lib/query/inside.glsl"
#include "../lib/query/cell_code.glsl"

layout(set = 0, binding = BIND_CELL_GRID, scalar) readonly buffer Grid { CellGrid grid; };
layout(set = 0, binding = BIND_CELLS, std430) buffer Cells { uint cells[]; };
layout(set = 0, binding = BIND_PARENT_CELLS, std430) readonly buffer Parents { uint parents[]; };
layout(set = 0, binding = BIND_SHADOWS, std430) readonly buffer Shadows { float shadows[]; };

// Returns true if the projection of the triangle a b c along the axis e x (unit vector) may meet that of the cube with
// half side h. (p, q): the other two coordinates.
bool meets_across(vec2 e, vec2 a, vec2 b, vec2 c, float h) {
  vec3 along = e.x * vec3(a.y, b.y, c.y) - e.y * vec3(a.x, b.x, c.x);
  float most = larger(larger(along.x, along.y), along.z), least = smaller(smaller(along.x, along.y), along.z);
  float reach = h * (abs(e.x) + abs(e.y));
  return least <= reach && most >= -reach;
}
bool meets_edge(vec3 e, Corners v, float h) {
  return meets_across(e.yz, v.v0.yz, v.v1.yz, v.v2.yz, h) && meets_across(e.zx, v.v0.zx, v.v1.zx, v.v2.zx, h) &&
         meets_across(e.xy, v.v0.xy, v.v1.xy, v.v2.xy, h);
}

// Returns true if a triangle may touch the cube around the probe whose half side is its padding.
bool may_touch(Probe p, uint texel) {
  TriangleTexels triangle = fetch_triangle(texel, AS_STORED);
  Corners v = corners_around(p, triangle), given = CORNERS_OF(triangle);
  float h = p.pad * p.scale;
  vec3 least = smaller(smaller(v.v0, v.v1), v.v2), most = larger(larger(v.v0, v.v1), v.v2);
  if (any(greaterThan(least, vec3(h))) || any(lessThan(most, vec3(-h)))) return false;
  vec3 ab = (given.v1 - given.v0) * p.scale, bc = (given.v2 - given.v1) * p.scale, ca = (given.v0 - given.v2) * p.scale;
  vec3 normal = cross(ab, ca), size = abs(ab.yzx * ca.zxy) + abs(ab.zxy * ca.yzx), at = abs(v.v0);
  // What rounds: 2^-20 of all products.
  float room = 9.5367432e-7 * dot(size, at + h);
  if (abs(dot(normal, v.v0)) > h * (abs(normal.x) + abs(normal.y) + abs(normal.z)) + room) return false;
  return meets_edge(ab, v, h) && meets_edge(bc, v, h) && meets_edge(ca, v, h);
}

uint stack[STACK_SIZE];

// Returns true if a triangle may touch the cube, or the walk did not end.
bool is_touched(Probe p) {
  uint top = 0u, node = push.root;
  bool touched = false;
  stack[top++] = END_OF_TREE;
  while (node != END_OF_TREE) {
    while (is_inner(node)) {
      Pair pair = fetch_pair(node);
      bool l = outside_of(p, pair.l) == vec3(0.0), r = outside_of(p, pair.r) == vec3(0.0);
      uint popped = stack[top - 1u];
      stack[top] = pair.right;
      top += uint(l && r);
      top -= uint(!(l || r));
      node = l ? pair.left : r ? pair.right : popped;
    }
    if (CAME_TO_LEAF(node)) {
      uint block = node & LEAF_TEXEL_MASK, count = (node >> LEAF_COUNT_SHIFT & 7u) + 1u, i = 0u;
      do {
        touched = touched || may_touch(p, block + LEAF_HEADER_TEXELS + i * TRIANGLE_TEXELS);
        ++i;
      } while (i < count);
      node = touched ? END_OF_TREE : stack[--top];
    }
  }
  return touched;
}

// Returns the parity of crossings of the ray along +x.
uint parity_at(Probe p, bool live) {
  uint top = 0u, node = live ? push.root : END_OF_TREE, crossings = 0u;
  stack[top++] = END_OF_TREE;
#include "../lib/query/inside_walk.glsl"
  return crossings & 1u;
}

// Returns what a cell is whose parent is touched.
uint state_of(uint code) {
  uvec3 cell = cell_of(code);
  vec3 from = vec3(cell) * grid.cell;
  precise vec3 at = grid.lo + (from + 0.5 * grid.cell);
  if (grid.lo.x + from.x - grid.pad <= shadows[grid.shadows + (cell.y << grid.level) + cell.z]) return CELL_TOUCHED;
  Probe p = make_probe(at);
  float pad = p.pad;
  p.pad = 0.5 * grid.cell + grid.pad;
  bool touched = is_touched(p);
  p.pad = pad;
  uint parity = parity_at(p, !touched);
  return touched || !finish_walks(1u) ? CELL_TOUCHED : parity;
}

void main() {
  uint code = push.ray_begin + gl_GlobalInvocationID.x;
  if (code >= push.ray_end) return;
  uint state = grid.level == FIRST_CELL_LEVEL ? CELL_TOUCHED : CELL_IN(parents, code >> 3);
  if (state == CELL_TOUCHED) state = state_of(code);
  if (state != 0u) atomicOr(cells[code >> 4], state << 2u * (code & 15u));
}
