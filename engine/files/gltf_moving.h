// Reads what moves in a glTF file: nodes, skins, and the meshes that follow them. Internal to engine/files.
#pragma once

#include <map>
#include <memory>
#include <vector>

#include "engine/files/gltf_mesh.h"
#include "engine/files/gltf_nodes.h"
#include "engine/model/animation.h"

namespace ballot {

/// A primitive that a node places, and where its triangles are in the scene.
struct PlacedPrimitive {
  const OpenPrimitive* primitive;
  std::size_t node;
  glm::dmat4 node_from_mesh;  // of an instance
  bool instanced;
  bool turned;  // append_primitive()
  std::size_t first_triangle;
};

/// Returns true if the file has animations, skins or morph targets.
bool may_move(const GltfFile& file);

/// Reads the nodes and animations of a file.
Animation read_animation(GltfFile& file, const std::vector<int>& parents);

/// Returns, for each node, true if a clip moves it or a node above it.
std::vector<bool> moving_nodes(const Animation& animation);

/// Returns, for each node, true if a clip may change whether its matrix mirrors: a scale of it or of a node above it
/// has negative numbers, or is a spline, which may have.
std::vector<bool> turning_nodes(const Animation& animation);

/// Reads skins, and the vertices of those primitives that move, have a skin or morph targets. Returns Scene::turned.
/// Throws Error(Work) on joints and counts that do not fit.
std::vector<bool> read_moving(GltfFile& file, const std::vector<PlacedPrimitive>& placed, Animation& to);

}  // namespace ballot
