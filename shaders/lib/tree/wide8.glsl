// The eight-wide tree (shared/layout.h), shared by the lanes of a packet: lane c holds child c of the current node. If
// the subgroup has fewer lanes than a node has children, lane c also holds child c + SUBGROUP_SIZE.
#include "format.glsl"

const bool TWO_A_LANE = SUBGROUP_SIZE < WIDE8_CHILDREN;
const uint SHARING_LANES = TWO_A_LANE ? SUBGROUP_SIZE : WIDE8_CHILDREN;

struct WideChild {
  vec3 lo, hi;  // mirrored
  uint child;  // an eight-wide node, a leaf, or END_OF_TREE
};

struct WideNode {
  WideChild mine, second;  // the children that this lane holds
};

WideChild fetch_child(uint node, uint c) {
  uvec4 a = format_texel(node * WIDE8_NODE_TEXELS + c), b = format_texel(node * WIDE8_NODE_TEXELS + WIDE8_CHILDREN + c);
  vec3 lo = uintBitsToFloat(a.xyz), hi = uintBitsToFloat(b.xyz);
  return WideChild(mix(lo, -hi, packet_down), mix(hi, -lo, packet_down), a.w);
}

WideNode fetch_wide(uint node) {
  uint c = gl_SubgroupInvocationID % SHARING_LANES;
  WideChild mine = fetch_child(node, c);
  if (TWO_A_LANE) return WideNode(mine, fetch_child(node, c + SHARING_LANES));
  return WideNode(mine, mine);
}

// Returns child c to every lane. c is the same in all lanes.
WideChild child_of(WideNode n, uint c) {
  uint lane = c % SHARING_LANES;
  bool second = TWO_A_LANE && c >= SHARING_LANES;
  return WideChild(subgroupShuffle(second ? n.second.lo : n.mine.lo, lane),
                   subgroupShuffle(second ? n.second.hi : n.mine.hi, lane),
                   subgroupShuffle(second ? n.second.child : n.mine.child, lane));
}

// Returns a key that orders children by entry, then by number, which is in the last bits. NO_CHILD if the packet does
// not meet the child or its bit in `open` is clear.
const uint CHILD_BITS = WIDE8_CHILDREN - 1u, NO_CHILD = 0xFFFFFFFFu;
uint child_key(PacketBounds p, WideChild child, uint c, uint open, float t_max) {
  float entry;
  bool met =
      packet_may_meet(p, child.lo, child.hi, t_max, entry) && child.child != END_OF_TREE && (open >> c & 1u) != 0u;
  return met ? floatBitsToUint(larger(entry, 0.0)) & ~CHILD_BITS | c : NO_CHILD;
}

// Clears the bits in `open` of the children that the packet does not meet. Returns the key of the nearest child that is
// left, or NO_CHILD if none is.
uint nearest_child(PacketBounds p, WideNode n, float t_max, inout uint open) {
  uint c = gl_SubgroupInvocationID % SHARING_LANES;
  uint key = child_key(p, n.mine, c, open, t_max);
  uint met = key != NO_CHILD ? 1u << c : 0u;
  if (TWO_A_LANE) {
    uint second = child_key(p, n.second, c + SHARING_LANES, open, t_max);
    met |= second != NO_CHILD ? 1u << (c + SHARING_LANES) : 0u;
    key = min(key, second);
  }
  open = lanes_or(met);
  return lanes_min(key);
}
