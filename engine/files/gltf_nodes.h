// The nodes of a glTF file: their tree, and where they lie. Internal to engine/files.
#pragma once

#include <glm/mat4x4.hpp>
#include <string>
#include <vector>

#include "engine/files/gltf_file.h"

namespace ballot {

/// A node of the default scene, at rest.
struct PlacedNode {
  std::size_t node;
  glm::dmat4 world_from_node;
};

/// Returns the index of a node. Throws Error(Work) if there is no such node; `place` names what points to it.
std::size_t checked_node(const GltfFile& file, int node, const std::string& place);

/// Returns the parent of every node (-1: none). Throws Error(Work) unless the nodes form trees.
std::vector<int> parents_of(const GltfFile& file);

/// Returns the nodes of the default scene with their transforms, depth first in file order. Throws Error(Work).
std::vector<PlacedNode> placed_nodes(const GltfFile& file, const std::vector<int>& parents);

}  // namespace ballot
