// glTF materials, cameras and node transforms as Ballot's. Internal to engine/scene.
#pragma once

#include <glm/mat4x4.hpp>
#include <string>
#include <vector>

#include "engine/scene/gltf_file.h"
#include "engine/scene/gltf_texture.h"
#include "engine/scene/scene.h"

namespace ballot {

/// Textures are read through `textures`; null: the material is not in use and has none. Throws Error(Work).
Material convert_material(const GltfFile& file, std::size_t index, GltfTextures* textures,
                          std::vector<std::string>& notes);

/// The light of KHR_lights_punctual that a node places. Throws Error(Work) on an index or a type that is not there.
Light convert_light(const GltfFile& file, std::size_t node, const glm::dmat4& world_from_node);
/// Whether the node has one.
bool has_light(const tinygltf::Node& node);

/// Parent from node: `matrix`, else T * R * S. Throws Error(Work) on arrays of the wrong length.
glm::dmat4 node_matrix(const GltfFile& file, std::size_t node);

/// The view of a camera node; scale is removed from its transform. `number` names it if the file does not.
View convert_camera(const GltfFile& file, std::size_t node, const glm::dmat4& world_from_node, std::size_t number);

}  // namespace ballot
