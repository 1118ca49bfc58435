// Extensions, push constants, buffers and node fetch. Every traversal kernel includes this file first.
#extension GL_EXT_scalar_block_layout : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_EXT_control_flow_attributes : require
#if BALLOT_COOPERATIVE || BALLOT_PACKET_STACK == 1 || defined(METHOD_PACKETS) || defined(METHOD_REDUCES) || \
    defined(METHOD_TURNS)
#extension GL_KHR_shader_subgroup_shuffle : require
#endif
#if BALLOT_REDUCE == 1
#extension GL_KHR_shader_subgroup_arithmetic : require
#endif
#if BALLOT_UNIFORM_FLOW && !defined(METHOD_CALLED)
#extension GL_EXT_subgroup_uniform_control_flow : require
#endif
#if BALLOT_FETCH == 2
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#endif

#include "../../shared/layout.h"
#include "../../shared/variant.h"
#if BALLOT_CAMERA
#include "../../shared/render.h"
#endif

// CALLED_INCLUDED: the text is a part of a program's own shader, whose are workgroup, specialisation constants and push
// constants. Sizes of stacks are defines there, and what other kernels have as push constants is a buffer.
#ifdef CALLED_INCLUDED
#define PUSHED set = 0, binding = BIND_PUSHED
const uint STACK_SIZE = CALLED_STACK, LIST_SIZE = 0u;
#else
#define PUSHED push_constant
layout(local_size_x_id = SPEC_GROUP_SIZE, local_size_y = 1, local_size_z = 1) in;
layout(constant_id = SPEC_STACK_SIZE) const uint STACK_SIZE = 32;
layout(constant_id = SPEC_GROUP_SUBGROUPS) const uint GROUP_SUBGROUPS = 16;
layout(constant_id = SPEC_SUBGROUP_SIZE) const uint SUBGROUP_SIZE = 4;
layout(constant_id = SPEC_LIST_SIZE) const uint LIST_SIZE = 0;
#endif

#if BALLOT_INSTANCES
#ifdef CALLED_INCLUDED
const uint TOP_STACK_SIZE = CALLED_TOP_STACK;
#else
layout(constant_id = SPEC_TOP_STACK) const uint TOP_STACK_SIZE = 48;
#endif
layout(PUSHED, scalar) uniform Push {
  TracePush whole_push;
  TopPush top_push;
};
// The push constants as the kernel of one mesh's tree has them, for the mesh that is walked (lib/tree/instances.glsl).
TracePush push;
uint first_node, first_leaf, first_format;  // the mesh's first texels
#define NODE_AT(texel) (first_node + (texel))
#define LEAF_AT(texel) (first_leaf + (texel))
#define FORMAT_AT(texel) (first_format + (texel))
#else
layout(PUSHED, scalar) uniform Push { TracePush push; };
#define NODE_AT(texel) (texel)
#define LEAF_AT(texel) (texel)
#define FORMAT_AT(texel) (texel)
#endif

// Rays and hits are read and written in units of 16 bytes: a compiler loads each scalar of a scalar record by itself.
#ifdef METHOD_CALLED
#include "../called/frame.glsl"
#elif BALLOT_CAMERA
layout(set = 0, binding = BIND_CAMERAS, scalar) readonly buffer Cameras { PrimaryPush cameras[]; };
layout(set = 0, binding = BIND_LISTED, scalar) readonly buffer Listed { uint listed[]; };
#include "../camera/camera_samples.glsl"
#elif BALLOT_RAYS_DOUBLE && BALLOT_RAY_TEXELS
layout(set = 0, binding = BIND_RAYS) uniform usamplerBuffer ray_texels;
uvec4 ray_part(uint i) { return texelFetch(ray_texels, int(i)); }
#elif BALLOT_RAYS_DOUBLE
layout(set = 0, binding = BIND_RAYS, std430) readonly buffer Rays { uvec4 ray_parts[]; };
uvec4 ray_part(uint i) { return ray_parts[i]; }
#elif BALLOT_RAY_TEXELS
layout(set = 0, binding = BIND_RAYS) uniform usamplerBuffer ray_texels;
vec4 ray_half(uint i) { return uintBitsToFloat(texelFetch(ray_texels, int(i))); }
#else
layout(set = 0, binding = BIND_RAYS, std430) readonly buffer Rays { vec4 ray_halves[]; };
vec4 ray_half(uint i) { return ray_halves[i]; }
#endif
#ifndef METHOD_CALLED
layout(set = 0, binding = BIND_HITS, std430) writeonly buffer Hits { uvec4 hit_words[]; };
#endif
#ifndef CALLED_INCLUDED
layout(set = 0, binding = BIND_WORK, scalar) buffer WorkCounter { Work work; };
#endif

#include "doubtful.glsl"

// The end of the ray range: rays before RAY_END are traced.
#ifdef METHOD_CALLED
#define RAY_END 1u
#elif BALLOT_DOUBTFUL == DOUBTFUL_TAKEN
uint ray_end;  // set by main()
#define RAY_END ray_end
#elif BALLOT_INDIRECT
layout(set = 0, binding = BIND_INDIRECT, scalar) readonly buffer Indirect { IndirectArgs indirect[]; };
uint ray_end;  // set by main()
#define RAY_END ray_end
#else
#define RAY_END push.ray_end
#endif

// READS_NODES: the kernel reads the binary tree. Packets without fallback read the eight-wide tree alone, and bvh4 the
// four-wide tree.
#if !defined(METHOD_WITHOUT_PAIRS) && (!defined(METHOD_PACKETS) || BALLOT_FALLBACK)
#define READS_NODES
#endif

#if BALLOT_FETCH == FETCH_STORAGE
#ifdef READS_NODES
layout(set = 0, binding = BIND_NODES, scalar) readonly buffer Nodes { uvec4 nodes[]; };
uvec4 node_texel(uint texel) { return nodes[NODE_AT(texel)]; }
#endif
layout(set = 0, binding = BIND_LEAVES, scalar) readonly buffer Leaves { uvec4 leaves[]; };
uvec4 leaf_texel(uint texel) { return leaves[LEAF_AT(texel)]; }
#elif BALLOT_FETCH == FETCH_TEXEL
// Unsigned texels: small integers would be denormal floats, which a device may flush.
#ifdef READS_NODES
layout(set = 0, binding = BIND_NODES) uniform usamplerBuffer nodes;
uvec4 node_texel(uint texel) { return texelFetch(nodes, int(NODE_AT(texel))); }
#endif
layout(set = 0, binding = BIND_LEAVES) uniform usamplerBuffer leaves;
uvec4 leaf_texel(uint texel) { return texelFetch(leaves, int(LEAF_AT(texel))); }
#else
layout(buffer_reference, std430, buffer_reference_align = 16) readonly buffer Texels { uvec4 at[]; };
#if BALLOT_LARGE
// Drivers compute the byte of an index in 32 bits, so that an index reaches 4 GiB. This is slower by 5 % (H200).
uvec2 address_of(uint lo, uint hi, uint texel) {
  uint carry;
  uint low = uaddCarry(lo, texel << 4, carry);
  return uvec2(low, hi + (texel >> 28) + carry);
}
#define TEXEL_AT(lo, hi, texel) Texels(address_of(lo, hi, texel)).at[0]
#else
#define TEXEL_AT(lo, hi, texel) Texels(uvec2(lo, hi)).at[texel]
#endif
uvec4 node_texel(uint texel) { return TEXEL_AT(push.nodes_lo, push.nodes_hi, NODE_AT(texel)); }
uvec4 leaf_texel(uint texel) { return TEXEL_AT(push.leaves_lo, push.leaves_hi, LEAF_AT(texel)); }
#endif

#if BALLOT_TRIANGLE == TRIANGLE_DOUBLE
#include "../numeric/in_double.glsl"
#define LOAD_RAY load_single
#else
#define LOAD_RAY load_ray
#endif

#if BALLOT_RAYS_DOUBLE
Ray load_ray(uint index) {
  uint at = 4u * RAY_AT(index);
  given_in_double = double_ray_of(ray_part(at), ray_part(at + 1u), ray_part(at + 2u), ray_part(at + 3u));
  return rounded(given_in_double);
}
#else
Ray LOAD_RAY(uint index) {
#ifdef METHOD_CALLED
  return asked_ray;
#elif BALLOT_CAMERA
  return camera_ray_of(cameras[push.camera], pixel_sample(samples_of(cameras[push.camera]), RAY_AT(index)));
#else
  uint ray = RAY_AT(index);
  vec4 a = ray_half(2u * ray), b = ray_half(2u * ray + 1u);
  return Ray(a.xyz, a.w, b.xyz, b.w);
#endif
}
#if BALLOT_TRIANGLE == TRIANGLE_DOUBLE
Ray load_ray(uint index) {
  Ray ray = load_single(index);
  given_in_double = widen(ray);
  return ray;
}
#endif
#endif

void store_hit(uint index, Hit hit) {
  hit_words[RAY_AT(index)] = uvec4(floatBitsToUint(hit.t), hit.prim, floatBitsToUint(hit.u), floatBitsToUint(hit.v));
}

bool is_inner(uint node) { return int(node) >= 0; }

#include "cut_loops.glsl"

// A box in the form of the layout: bounds lo and hi, or centre and half extents.
struct NodeBox {
  vec3 a, b;
};

// The two children of an inner node.
struct Pair {
  NodeBox l, r;
  uint left, right;  // child references
};

Pair unpack_pair(uvec4 a, uvec4 b, uvec4 c, uvec4 d) {
  Pair p;
#if BALLOT_LAYOUT == LAYOUT_COMPACT
  p.l = NodeBox(uintBitsToFloat(a.xyz), uintBitsToFloat(c.xyz));
  p.r = NodeBox(uintBitsToFloat(b.xyz), uintBitsToFloat(c.xyz << 16));
  p.left = a.w;
  p.right = b.w;
#elif BALLOT_LAYOUT != LAYOUT_PAPER
  vec4 l = uintBitsToFloat(a), r = uintBitsToFloat(b), z = uintBitsToFloat(c);
  p.l = NodeBox(vec3(l.x, l.z, z.x), vec3(l.y, l.w, z.y));
  p.r = NodeBox(vec3(r.x, r.z, z.z), vec3(r.y, r.w, z.w));
  p.left = d.x;
  p.right = d.y;
#else
  p.l = NodeBox(uintBitsToFloat(a.xyz), uintBitsToFloat(uvec3(a.w, b.xy)));
  p.r = NodeBox(uintBitsToFloat(c.xyz), uintBitsToFloat(uvec3(c.w, d.xy)));
  p.left = b.z == 0u ? b.w : LEAF_BIT | (b.z - 1u) << LEAF_COUNT_SHIFT | b.w;
  p.right = d.z == 0u ? d.w : LEAF_BIT | (d.z - 1u) << LEAF_COUNT_SHIFT | d.w;
#endif
  return p;
}

#ifdef READS_NODES
Pair fetch_pair(uint node) {
#if BALLOT_LAYOUT == LAYOUT_COMPACT
  return unpack_pair(node_texel(node), node_texel(node + 1u), node_texel(node + 2u), uvec4(0u));
#else
  return unpack_pair(node_texel(node), node_texel(node + 1u), node_texel(node + 2u), node_texel(node + 3u));
#endif
}
#endif

#include "stats.glsl"
#include "../numeric/numeric.glsl"
#include "../tree/leaf.glsl"
