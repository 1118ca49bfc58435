// glTF materials, cameras and node transforms as Ballot's. Internal to engine/scene.
#pragma once

#include <glm/mat4x4.hpp>
#include <string>
#include <vector>

#include "engine/scene/gltf_file.h"
#include "engine/scene/scene.h"

namespace ballot {

Material convert_material(const tinygltf::Material& from, std::size_t index, std::vector<std::string>& notes);

/// Parent from node: `matrix`, else T * R * S. Throws Error(Work) on arrays of the wrong length.
glm::dmat4 node_matrix(const GltfFile& file, std::size_t node);

/// The view of a camera node; scale is removed from its transform. `number` names it if the file does not.
View convert_camera(const GltfFile& file, std::size_t node, const glm::dmat4& world_from_node, std::size_t number);

}  // namespace ballot
