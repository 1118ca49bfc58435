// Boxes of a tree that are widened once for all rays, so that no box culls what the watertight test accepts.
#pragma once

#include <vector>

#include "engine/bvh/bvh.h"

namespace ballot {

/// The farthest that a ray's origin may be from box_origin(), along an axis and in scene units, for padded_boxes() to serve it;
/// rays from farther away meet every box. It is half of the distance from any point of the scene that the proof allows. 0 where
/// the scene is so large or small that products leave the normal range of float32: then rays have to pad boxes themselves
/// (shaders/lib/numeric/box_padded.glsl).
float padded_reach(const Bounds& scene);

/// The boxes of all nodes, measured from box_origin() and wider by what shaders/lib/numeric/box_widened.glsl derives: that grows with a box's
/// coordinates and with the triangles below it, and not with the scene.
std::vector<Bounds> padded_boxes(const Bvh& bvh, std::span<const Triangle> triangles);

}  // namespace ballot
