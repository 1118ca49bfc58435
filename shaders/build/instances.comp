#version 460
#extension GL_GOOGLE_include_directive : require
// Places instances: writes the record of each (shaders/shared/layout.h), and finds the first whose transform cannot be
// placed. As place_instance() of engine/tree/host/instance.cpp, which derives the box and the slack: every operation is
// rounded by itself, in the same order, in float64. So records have the bits of the host's, but for numbers below
// 2^-126.
#include "../lib/build/frame.glsl"

layout(push_constant, scalar) uniform Push { InstancePush push; };
layout(set = 0, binding = BIND_BUILD_STATE, scalar) buffer State { BuildState state; };
layout(set = 0, binding = BIND_BUILD_TRANSFORMS, std430) readonly buffer Transforms { float transforms[]; };
layout(set = 0, binding = BIND_BUILD_PARTS, std430) readonly buffer Parts { uvec2 parts[]; };
layout(set = 0, binding = BIND_BUILD_MESHES, scalar) readonly buffer Meshes { MeshExtent meshes[]; };
layout(set = 0, binding = BIND_BUILD_TOP, std430) writeonly buffer Top { uvec4 top_texels[]; };
#include "../lib/build/next.glsl"

const double ULP = 5.9604644775390625e-8LF;  // 2^-24
const double LARGEST_COORDINATE = 1e12LF, LARGEST_CONDITION = 1048576.0LF;
const float LARGEST_SCALE = 1152921504606846976.0, SMALLEST_SCALE = 1.0 / LARGEST_SCALE;  // 2^60

double m[3][3], t[3];  // the matrix and the translation
double a[3][3];        // the inverse
bool mirrors;          // the matrix does

bool is_finite(float x) { return (floatBitsToUint(x) & 0x7F800000u) != 0x7F800000u; }

// Reads a transform. Returns false if one of its numbers cannot be used.
bool read_transform(uint instance) {
  bool usable = true;
  vec3 most = vec3(0.0);
  for (uint r = 0u; r < 3u; ++r)
    for (uint c = 0u; c < 4u; ++c) {
      float x = transforms[12u * instance + 4u * r + c];
      usable = usable && is_finite(x);
      if (c < 3u) {
        m[r][c] = double(x);
        most[c] = max(most[c], abs(x));
      } else {
        t[r] = double(x);
      }
    }
  return usable && all(greaterThanEqual(most, vec3(SMALLEST_SCALE))) && all(lessThanEqual(most, vec3(LARGEST_SCALE)));
}

double cofactor(uint r, uint c) {
  uint i = (r + 1u) % 3u, k = (r + 2u) % 3u, d = (c + 1u) % 3u, e = (c + 2u) % 3u;
  precise double x = m[i][d] * m[k][e] - m[i][e] * m[k][d];
  return x;
}

double reciprocal(double x) {
  uint high = unpackDouble2x32(x).y, seed = 0x7FDE6238u - (high & 0x7FFFFFFFu);
  precise double y = packDouble2x32(uvec2(0u, (high & 0x80000000u) | (seed & 0x7FFFFFFFu)));
  for (uint step = 0u; step < 6u; ++step) y = y + y * (1.0LF - x * y);
  return y;
}

// Inverts the matrix. Returns the largest factor by which it multiplies rounding errors.
double invert() {
  precise double det = m[0][0] * cofactor(0u, 0u) + m[0][1] * cofactor(0u, 1u) + m[0][2] * cofactor(0u, 2u);
  double over = reciprocal(det);
  mirrors = det < 0.0LF;
  for (uint r = 0u; r < 3u; ++r)
    for (uint c = 0u; c < 3u; ++c) {
      precise double x = cofactor(c, r) * over;
      a[r][c] = x;
    }
  double condition = 0.0LF;
  bool usable = det != 0.0LF;
  for (uint k = 0u; k < 3u; ++k) {
    precise double sum = 0.0LF;
    for (uint i = 0u; i < 3u; ++i)
      for (uint j = 0u; j < 3u; ++j) sum = sum + abs(m[k][i] * a[i][j]);
    usable = usable && sum <= LARGEST_CONDITION;
    condition = max(condition, sum);
  }
  return usable ? condition : 2.0LF * LARGEST_CONDITION;
}

// Moves the bounds of a mesh. Returns false if they leave the range of coordinates.
bool move_bounds(MeshExtent mesh, out double lo[3], out double hi[3]) {
  bool usable = true;
  for (uint k = 0u; k < 3u; ++k) {
    precise double low = t[k], high = t[k];
    for (uint i = 0u; i < 3u; ++i) {
      precise double x = m[k][i] * double(mesh.lo[i]), y = m[k][i] * double(mesh.hi[i]);
      low = low + min(x, y);
      high = high + max(x, y);
    }
    lo[k] = low;
    hi[k] = high;
    usable = usable && max(max(abs(low), abs(high)), abs(t[k])) <= LARGEST_COORDINATE;
  }
  return usable;
}

// Widens the moved bounds along an axis by the errors that no ray adds to, and rounds them outwards.
vec2 widened(MeshExtent mesh, double lo[3], double hi[3], uint k) {
  double longest = double(max(mesh.triangle.x, max(mesh.triangle.y, mesh.triangle.z)));
  precise double pad = 0.0LF;
  for (uint i = 0u; i < 3u; ++i) {
    pad = pad + abs(m[k][i]) * (18.0LF * double(mesh.triangle[i]) + 31.0LF * longest);
    for (uint j = 0u; j < 3u; ++j) {
      precise double below = lo[j] - t[j], above = t[j] - hi[j];
      pad = pad + abs(m[k][i] * a[i][j]) * 5.1LF * max(max(below, above), 0.0LF);
    }
  }
  pad = pad * (1.05LF * ULP);
  precise double own = 8.8817841970012523e-16LF * (abs(lo[k]) + abs(hi[k]) + abs(t[k]));  // 2^-50
  precise double down = lo[k] - pad - own, up = hi[k] + pad + own;
  return vec2(next_down(vec3(float(down))).x, next_up(vec3(float(up))).x);
}

void write_record(uint instance, vec3 lo, vec3 hi, float slack) {
  uint at = push.instances * TOP_NODE_TEXELS + instance * INSTANCE_TEXELS;
  for (uint r = 0u; r < 3u; ++r)
    top_texels[at + r] = floatBitsToUint(vec4(float(a[r][0]), float(a[r][1]), float(a[r][2]), float(t[r])));
  top_texels[at + 3u] = uvec4(floatBitsToUint(lo), parts[instance].x);
  top_texels[at + 4u] = uvec4(floatBitsToUint(hi), floatBitsToUint(slack));
  top_texels[at + 5u] = uvec4(parts[instance].y, uint(mirrors), 0u, 0u);
}

void place(uint instance) {
  MeshExtent mesh = meshes[parts[instance].x];
  bool usable = read_transform(instance);
  double condition = invert(), lo[3], hi[3];
  usable = usable && condition <= LARGEST_CONDITION;
  vec3 box_lo = vec3(0.0), box_hi = vec3(0.0);
  float slack = 0.0;
  if (mesh.empty == 0u && usable) {
    usable = move_bounds(mesh, lo, hi);
    for (uint k = 0u; k < 3u; ++k) {
      vec2 ends = widened(mesh, lo, hi, k);
      box_lo[k] = ends.x;
      box_hi[k] = ends.y;
    }
    precise double sum = 50.0LF * ULP * (1.0LF + 1e-6LF) * condition + 8.0LF * ULP;
    slack = float(sum);
  }
  if (!usable) {
    atomicMin(state.refused, instance);
    slack = 0.0;  // not in the tree
  }
  write_record(instance, box_lo, box_hi, slack);
}

void main() {
  for (uint i = gl_GlobalInvocationID.x; i < push.instances; i += gl_NumWorkGroups.x * GROUP_SIZE) place(i);
}
