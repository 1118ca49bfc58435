// Padded boxes: boxes of a tree that are widened once for all rays, so that no box culls a triangle that the watertight
// test accepts.
#pragma once

#include <vector>

#include "engine/tree/host/bvh.h"

namespace ballot {

/// Returns the largest distance of a ray's origin from box_origin(), along any axis and in scene units, for which
/// padded_boxes() are wide enough. A ray from farther away is taken to meet every box. The value is half of the
/// distance from any point of the scene that the proof allows. It is 0 where the scene is so large or so small that
/// products leave the normal range of float32; then each ray has to pad the boxes itself
/// (shaders/lib/numeric/box_padded.glsl).
float padded_reach(const Bounds& scene);

/// Returns the padded boxes of all nodes, measured from box_origin(). shaders/lib/numeric/box_widened.glsl derives the
/// padding. It grows with the coordinates of the box and with the extent of the triangles below it, but not with the
/// scene.
std::vector<Bounds> padded_boxes(const Bvh& bvh, std::span<const Triangle> triangles);

}  // namespace ballot
