#version 460
#extension GL_GOOGLE_include_directive : require
// Winding: for each point, the generalised winding number of the triangles: the sum of their signed solid angles over 4
// pi. For a closed mesh that is 1 inside and 0 outside; for open ones it goes from one to the other across the gaps. A
// walk of the pair tree, one point a lane.
//
// Sources: Gavin Barill, Neil G. Dickson, Ryan Schmidt, David I. W. Levin, Alec Jacobson. Fast Winding Numbers for
// Soups and Clouds. ACM Transactions on Graphics 37(4), 2018 (a node far away is replaced by the first terms of its
// Taylor series); A. van Oosterom, J. Strackee. The Solid Angle of a Plane Triangle. IEEE Transactions on Biomedical
// Engineering 30(2), 1983. Differs: tensors are symmetric, without traces, and in units of the node's radius.
//
// A node counts as far if the distance d of its centre p from the point q is more than beta times its radius r, which
// holds all its triangles. With normals n, integrals over its triangles, and the symmetric parts of tensors without
// their traces, D = integral of n / r^2, Q = -3 times that of n (x - p) / r^3, T = 7.5 times that of
// n (x - p) (x - p) / r^4, u = (p - q) / d and x = r / d, which is below 1 / beta:
//   4 pi w = x^2 D . u + x^3 Q(u, u) + x^4 T(u, u, u) + terms of x^5.
//
// Rounding: a triangle's determinant is that of a corner and two edges, so it is off by some 2^-22 of the product of
// their lengths, and its angle by some 2^-22. The angle of a corner at the point, and the sign on a triangle, are
// arbitrary. Result: a float a point, 0 for a dead one; UNFINISHED if the walk did not finish. It depends on the tree.
#include "../lib/frame/kernel.glsl"
#include "../shared/query.h"
#include "../lib/query/frame.glsl"

layout(set = 0, binding = BIND_CROSSINGS, scalar) writeonly buffer Answers { uint answers[]; };
layout(set = 0, binding = BIND_NODE_MOMENTS, std430) readonly buffer Moments { vec4 moments[]; };

const float PI = 3.14159265;

// Returns the angle of (x, y) in [-pi, pi], to some 2^-22. atan() may be off by 2^-11.
float angle_of(float y, float x) {
  float a = abs(x), b = abs(y), most = max(a, b);
  if (most == 0.0) return 0.0;
  float t = min(a, b) / most, from = 0.0;
  if (t > 0.41421356) {
    t = (t - 1.0) / (t + 1.0);
    from = 0.25 * PI;
  }
  // Stephen L. Moshier. Methods and Programs for Mathematical Functions. 1989: the polynomial of atanf().
  float z = t * t;
  float series = ((8.05374449538e-2 * z - 1.38776856032e-1) * z + 1.99777106478e-1) * z - 3.33329491539e-1;
  float angle = from + series * z * t + t;
  if (b > a) angle = 0.5 * PI - angle;
  if (x < 0.0) angle = PI - angle;
  return y < 0.0 ? -angle : angle;
}

// Returns half the solid angle of a triangle.
float half_angle_of(Probe p, uint texel) {
  TriangleTexels triangle = fetch_triangle(texel, AS_STORED);
  Corners v = corners_around(p, triangle), given = CORNERS_OF(triangle);
  vec3 ab = (given.v1 - given.v0) * p.scale, ac = (given.v2 - given.v0) * p.scale;
  float a = length(v.v0), b = length(v.v1), c = length(v.v2);
  float across = dot(v.v0, cross(ab, ac));
  float along = a * b * c + dot(v.v0, v.v1) * c + dot(v.v1, v.v2) * a + dot(v.v2, v.v0) * b;
  return angle_of(across, along);
}

// The sum of shares, and what its additions have lost by rounding (Knuth's two-sum): a walk may add many thousands.
float sum = 0.0, lost = 0.0;
void add(float share) {
  precise float next = sum + share, back = next - sum, rest = (sum - (next - back)) + (share - back);
  lost += rest;
  sum = next;
}

// Adds the share of a node to 4 pi w if it is far. Returns true if it is near.
bool is_near(Probe p, uint at, float beta2) {
  vec4 ball = moments[at];
  vec3 d = ball.xyz * p.scale - p.scaled;
  float r = ball.w * p.scale, distance2 = dot(d, d);
  if (!(distance2 > beta2 * r * r)) return true;
  float inverse = inversesqrt(distance2), x = r * inverse;
  vec3 u = d * inverse, u2 = u * u;
  vec4 first = moments[at + 1u], second = moments[at + 2u], mixed = moments[at + 3u], third = moments[at + 4u];
  float bent = dot(second.xyz, u2) + 2.0 * dot(mixed.xyz, u.yzx * u.zxy);
  float twisted = u.x * (third.x * (3.0 * u2.y - u2.x) + third.z * (3.0 * u2.z - u2.x)) +
                  u.y * (second.w * (3.0 * u2.x - u2.y) + third.w * (3.0 * u2.z - u2.y)) +
                  u.z * (mixed.w * (3.0 * u2.x - u2.z) + third.y * (3.0 * u2.y - u2.z)) +
                  6.0 * first.w * u.x * u.y * u.z;
  add(x * x * (dot(first.xyz, u) + x * (bent + x * twisted)));
  return false;
}

void main() {
  uint index = push.ray_begin + gl_GlobalInvocationID.x;
  bool inside = index < push.ray_end;
  vec4 record = ray_half(inside ? index : push.ray_begin);
  bool live = inside && is_finite(record.xyz);
  Probe p = make_probe(live ? record.xyz : push.scene_lo);
  float beta2 = moments[0].x;
  uint stack[STACK_SIZE];
  uint top = 0u, node = live ? push.root : END_OF_TREE;
  stack[top++] = END_OF_TREE;
  while (node != END_OF_TREE) {
    while (is_inner(node)) {
      Pair pair = fetch_pair(node);
      uint at = 1u + node / PAIR_TEXELS(BALLOT_LAYOUT) * (2u * MOMENT_TEXELS);
      bool l = is_near(p, at, beta2), r = is_near(p, at + MOMENT_TEXELS, beta2);
      uint popped = stack[top - 1u];
      stack[top] = pair.right;
      top += uint(l && r);
      top -= uint(!(l || r));
      node = l ? pair.left : r ? pair.right : popped;
    }
    if (CAME_TO_LEAF(node)) {
      uint block = node & LEAF_TEXEL_MASK, count = (node >> LEAF_COUNT_SHIFT & 7u) + 1u, i = 0u;
      do {
        add(2.0 * half_angle_of(p, block + LEAF_HEADER_TEXELS + i * TRIANGLE_TEXELS));
        ++i;
      } while (i < count);
      node = stack[--top];
    }
  }
  if (inside) answers[index] = finish_walks(1u) ? floatBitsToUint((sum + lost) / (4.0 * PI)) : UNFINISHED;
}
