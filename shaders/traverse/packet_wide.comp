#version 460
#extension GL_GOOGLE_include_directive : require
// "packet-wide" traversal: the rays of a subgroup, several in every lane, take one path through a tree of up to eight
// children a node. Each lane tests one child against bounds of the whole packet. All rays then test the nearest child
// that the bounds meet, and the packet enters it if any ray meets it.
//
// Based on:
//   Marek Vinkler. Traversal methods for GPU ray tracing. Section 3.1 (the packet).
//   Ingo Wald, Solomon Boulos, Peter Shirley. Ray Tracing Deformable Scenes Using Dynamic Bounding Volume
//   Hierarchies. ACM Transactions on Graphics 26(1), 2007 (bounds of the packet first, then its rays).
//   Ingo Wald, Carsten Benthin, Solomon Boulos. Getting Rid of Packets: Efficient SIMD Single-Ray Traversal using
//   Multi-branching BVHs. RT 2008 (a child a lane).
// The bounds alone must not decide: on incoherent rays they meet nearly every box. Children are visited nearest first;
// in the order of the direction's signs alone, a packet may visit several times as many.
//
// The rays of a packet are grouped by the octant of their direction and by the order in which they read the texels of
// triangles. Each group sees rays and boxes mirrored so that it goes up along every axis (lib/numeric/numeric.glsl).
// With knob fallback, the rays of a packet that spreads over more than two octants are traced one by one
// (lib/tree/walk.glsl). So are those of a packet with rays that meet every box (lib/numeric/box_padded.glsl).
//
// walk_packet()
//   Flow   subgroup-uniform throughout, except for rays that are traced one by one
//   Memory STACK_SIZE words per subgroup; with fallback also STACK_SIZE per lane
#define METHOD_PACKETS
#include "../lib/frame/kernel.glsl"
#include "../lib/packet/packet_stack.glsl"
#include "../lib/frame/lanes.glsl"
#include "../lib/packet/packet_bounds.glsl"
#include "../lib/packet/packet_rays.glsl"
#include "../lib/tree/wide8.glsl"
#if BALLOT_FALLBACK
#include "../lib/tree/walk.glsl"
#include "../lib/tree/while_while.glsl"
#endif

const uint ALL_CHILDREN = (1u << WIDE8_CHILDREN) - 1u;

// Continues from an entry to the next leaf that some ray meets. Returns the leaf, or END_OF_TREE at the end of the
// walk. leaf_rays has a bit for each of this lane's rays that meet the leaf; anyone has the bits of all lanes.
uint find_leaf(PacketBounds bounds, float t_max, inout uint entry, out uint leaf_rays, out uint anyone) {
  uint leaf = END_OF_TREE;
  leaf_rays = anyone = 0u;
  if (entry == END_OF_TREE) return leaf;
  do {
    // Finds a node with a child that the packet may meet.
    uint key, open, below;
    WideNode node;
    do {
      below = packet_entry(packet_top - 1u);
      node = fetch_wide(entry >> WIDE8_CHILDREN);
      open = entry & ALL_CHILDREN;
      key = nearest_child(bounds, node, t_max, open);
      if (open == 0u) {
        entry = below;
        --packet_top;
      }
    } while (open == 0u && entry != END_OF_TREE);
    // Takes the nearest such child, if some ray meets it.
    WideChild child = child_of(node, key & CHILD_BITS);
    uint met = rays_that_meet(child.lo, child.hi), met_by_any = lanes_or(met);
    bool enter = open != 0u && met_by_any != 0u, inner = enter && is_inner(child.child);
    if (open != 0u) {
      open &= ~(1u << (key & CHILD_BITS));
      entry = entry & ~ALL_CHILDREN | open;
      if (inner && open != 0u) packet_store(packet_top++, entry);
      if (inner) entry = child.child << WIDE8_CHILDREN | ALL_CHILDREN;
      if (enter && !inner) leaf = child.child;
      if (enter && !inner) leaf_rays = met;
      if (enter && !inner) anyone = met_by_any;
      if (!inner && open == 0u) {
        entry = below;
        --packet_top;
      }
    }
    COUNT_STACK(packet_top)
    COUNT_WIDE(enter ? alive : 0u, met, inner)
  } while (leaf == END_OF_TREE && entry != END_OF_TREE);
  return leaf;
}

// Tests the rays that meet a leaf against its triangles. Sets entry to END_OF_TREE once no ray is looking for a hit any
// more.
void meet_leaf(uint leaf, uint leaf_rays, uint anyone, inout uint entry) {
  visit_packet_leaf(leaf, leaf_rays, anyone);
#if BALLOT_ANY_HIT
  if (!packet_looks()) entry = END_OF_TREE;
#endif
}

void walk_packet() {
  PacketBounds bounds = packet_bounds();
  packet_top = 0u;
  packet_store(packet_top++, END_OF_TREE);
  uint entry = END_OF_TREE;  // the current node, above a bit for each child that is still to be visited
  if (push.root != END_OF_TREE && packet_looks()) entry = ALL_CHILDREN;
  COUNT_WIDE(alive, alive, true)
  uint leaf, leaf_rays, anyone;
#if BALLOT_JUMP
  // With one copy of find_leaf() the kernel compiles in 0.9 of the time.
  do {
    leaf = find_leaf(bounds, packet_reach(), entry, leaf_rays, anyone);
    if (leaf != END_OF_TREE) meet_leaf(leaf, leaf_rays, anyone, entry);
  } while (leaf != END_OF_TREE);
#else
  // Without jumps, the loop above would visit a leaf in vain at the end: 0.97 times as fast.
  leaf = find_leaf(bounds, packet_reach(), entry, leaf_rays, anyone);
  if (leaf != END_OF_TREE) {
    do {
      meet_leaf(leaf, leaf_rays, anyone, entry);
      leaf = find_leaf(bounds, packet_reach(), entry, leaf_rays, anyone);
    } while (leaf != END_OF_TREE);
  }
#endif
}

#include "../lib/frame/main.glsl"
