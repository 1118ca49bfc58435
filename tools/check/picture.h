// A picture of a mesh and its faults, drawn without a device.
#pragma once

#include <string>

#include "engine/scene/device_scene.h"

namespace ballot::cli {

/// The faults of a mesh that a picture shows.
struct MeshFaults {
  Topology topology;  // with all faulty edges
  SelfCrossings crossed;
};

/// Draws the mesh in grey from an eye above its front right corner, and over it its faults: edges of one triangle red,
/// of more than two orange, of two that run the same way blue; triangles that pass through another yellow. Edges that
/// the mesh hides are drawn thinner. Writes a PNG. Throws Error(Work).
void draw_faults(const std::string& to, std::span<const Triangle> triangles, const MeshFaults& faults,
                 std::uint32_t size);

}  // namespace ballot::cli
