#version 460
#extension GL_GOOGLE_include_directive : require
// Writes the frontier of a tree (shaders/shared/layout.h) from its pairs, in one workgroup, as
// engine/tree/formats/frontier.cpp does on the host: the node of the largest area is opened until there are enough, and
// the nodes stand in order for each octant of directions. Areas are float32's here, so other nodes may be opened; no
// hit depends on which.
#include "../lib/build/frame.glsl"

layout(push_constant, scalar) uniform Push { FrontierPush push; };
layout(set = 0, binding = BIND_BUILD_STATE, scalar) readonly buffer State { BuildState state; };
layout(set = 0, binding = BIND_BUILD_FRONTIER, std430) writeonly buffer Frontier { uvec4 frontier[]; };
#include "../lib/build/area.glsl"
#include "../lib/build/read_pair.glsl"

const uint MOST_NODES = 64u, ENTRIES = 2u * MOST_NODES;
const float LARGEST = 3.402823466e38;

// The nodes met so far. Entry 0 is the root; the children of an opened node are entries side by side.
shared float box_lo[3u * ENTRIES], box_hi[3u * ENTRIES];
shared uint refs[ENTRIES], below[ENTRIES];  // child reference; the first child's entry, 0: not opened
shared uint areas[ENTRIES];                 // of inner nodes that are not opened, as bits; 0 of others
shared uint largest, chosen;

vec3 lo_at(uint i) { return vec3(box_lo[i], box_lo[ENTRIES + i], box_lo[2u * ENTRIES + i]); }
vec3 hi_at(uint i) { return vec3(box_hi[i], box_hi[ENTRIES + i], box_hi[2u * ENTRIES + i]); }

void put(uint i, Child c) {
  for (uint k = 0u; k < 3u; ++k) {
    box_lo[k * ENTRIES + i] = c.lo[k];
    box_hi[k * ENTRIES + i] = c.hi[k];
  }
  refs[i] = c.ref;
  below[i] = 0u;
  // 1 is added, so that inner nodes without area are opened too.
  areas[i] = c.ref >= LEAF_BIT ? 0u : floatBitsToUint(half_area(c.lo, c.hi)) + 1u;
}

// Chooses the entry of the largest area, of equal ones the first. Every invocation must call it.
void choose(uint entries) {
  if (gl_LocalInvocationIndex == 0u) {
    largest = 0u;
    chosen = ENTRIES;
  }
  barrier();
  for (uint i = gl_LocalInvocationIndex; i < entries; i += GROUP_SIZE) atomicMax(largest, areas[i]);
  barrier();
  for (uint i = gl_LocalInvocationIndex; i < entries; i += GROUP_SIZE)
    if (largest != 0u && areas[i] == largest) atomicMin(chosen, i);
  barrier();
}

// True if rays of this octant mostly meet the right box first. The axis along which the centres are farthest apart
// decides.
bool right_first(uint left, uint octant) {
  vec3 d = (lo_at(left + 1u) + hi_at(left + 1u)) - (lo_at(left) + hi_at(left)), a = abs(d);
  uint axis = a.x >= a.y && a.x >= a.z ? 0u : a.y >= a.z ? 1u : 2u;
  return (d[axis] < 0.0) != ((octant >> axis & 1u) != 0u);
}

void write_node(uint octant, uint place, vec3 lo, vec3 hi, uint ref) {
  uint at = 2u * (octant * push.nodes + place);
  frontier[at] = uvec4(floatBitsToUint(lo), ref);
  frontier[at + 1u] = uvec4(floatBitsToUint(hi), 0u);
}

// Writes the nodes front to back for rays of an octant.
void write_octant(uint octant) {
  uint todo[MOST_NODES], left = 0u, place = 0u;
  if (push.root != END_OF_TREE) todo[left++] = 0u;
  while (left > 0u) {
    uint entry = todo[--left], first = below[entry];
    if (first == 0u) {
      write_node(octant, place++, lo_at(entry), hi_at(entry), refs[entry]);
    } else {
      uint right = right_first(first, octant) ? 1u : 0u;
      todo[left++] = first + 1u - right;
      todo[left++] = first + right;
    }
  }
  while (place < push.nodes) write_node(octant, place++, vec3(LARGEST), vec3(-LARGEST), END_OF_TREE);
}

void main() {
  unit = unit_of(state.longest);
  if (gl_LocalInvocationIndex == 0u) put(0u, Child(vec3(-LARGEST), vec3(LARGEST), push.root));
  barrier();
  uint entries = 1u;
  for (uint n = 1u; n < push.nodes; ++n) {
    choose(entries);
    if (chosen == ENTRIES) break;
    uint side = gl_LocalInvocationIndex;
    if (side < 2u) put(entries + side, read_child(refs[chosen], side));
    barrier();
    if (gl_LocalInvocationIndex == 0u) {
      below[chosen] = entries;
      areas[chosen] = 0u;
    }
    barrier();
    entries += 2u;
  }
  for (uint octant = gl_LocalInvocationIndex; octant < 8u; octant += GROUP_SIZE) write_octant(octant);
}
