// Reads the triangles of a glTF file: those that its nodes place in the world, and meshes that are kept once with their
// instances. Internal to engine/files.
#pragma once

#include <map>
#include <vector>

#include "engine/files/gltf_moving.h"

namespace ballot {

using OpenMeshes = std::map<std::size_t, std::vector<OpenPrimitive>>;

/// Opens each mesh that the scene uses, once. Throws Error(Work).
OpenMeshes open_meshes(GltfFile& file, const std::vector<PlacedNode>& placed);

/// What moves with its node: primitives whose triangles do, and instances.
struct MovingPlaces {
  std::vector<PlacedPrimitive> primitives;
  std::vector<MovingPlacement> instances;
};

/// What the triangles of a scene are read from.
struct TriangleSource {
  const GltfFile& file;
  const OpenMeshes& meshes;
  const std::vector<PlacedNode>& placed;
  const std::vector<bool>& moves;  // each node: moving_nodes(); empty: nothing moves
  const std::vector<bool>& turns;  // each node: turning_nodes(); empty: nothing moves
};

/// Reads the triangles, numbered as load_scene() says. `where`, if set, gets the place of each primitive and of each
/// instance that moves. Throws Error(Work).
void read_triangles(const TriangleSource& from, Scene& scene, MovingPlaces* where);

}  // namespace ballot
