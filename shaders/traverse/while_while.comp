#version 460
#extension GL_GOOGLE_include_directive : require
// "while-while" traversal: every ray by itself. A ray walks inner nodes until it holds a leaf, then tests leaves until
// it holds an inner node, so that the lanes of a subgroup mostly do the same thing.
//
// Based on:
//   Timo Aila, Samuli Laine. Understanding the Efficiency of Ray Traversal on GPUs. HPG 2009. ("while-while")
//
// traverse(walker, live, node)
//   live   false if the lane has no ray
//   Flow   lanes diverge; no subgroup operations
//   Memory STACK_SIZE words per lane
#include "../lib/frame/kernel.glsl"
#include "../lib/tree/walk.glsl"
#include "../lib/tree/while_while.glsl"

#include "../lib/frame/main.glsl"
