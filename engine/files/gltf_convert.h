// Converts glTF materials, lights, cameras and node transforms to Ballot's. Internal to engine/files.
#pragma once

#include <glm/mat4x4.hpp>
#include <set>
#include <string>
#include <vector>

#include "engine/files/gltf_file.h"
#include "engine/files/gltf_texture.h"
#include "engine/model/animation.h"
#include "engine/model/scene.h"

namespace ballot {

/// An extension of older files: a material by its diffuse and specular colours.
inline constexpr const char* kSpecularGlossiness = "KHR_materials_pbrSpecularGlossiness";

/// Converts a material. Its textures are read through `textures`; null: the material is not in use and gets none.
/// Appends to `notes` what was mended. Throws Error(Work).
Material convert_material(const GltfFile& file, std::size_t index, GltfTextures* textures,
                          std::vector<std::string>& notes);

/// Appends a note for each extension of the materials `used` that Ballot does not model, with the number of materials.
void note_unmodelled(const GltfFile& file, const std::set<std::size_t>& used, std::vector<std::string>& notes);

/// Converts the light of KHR_lights_punctual that a node places.
/// Throws Error(Work) on an index out of range, an unknown type, a position or intensity that is not finite, and an
/// intensity below 0.
Light convert_light(const GltfFile& file, std::size_t node, const glm::dmat4& world_from_node);
/// Returns true if the node places a light.
bool has_light(const tinygltf::Node& node);

/// Returns the transform of a node to its parent: `matrix`, else translation, rotation and scale. Throws Error(Work) on
/// arrays of the wrong length.
NodeTransform node_transform(const GltfFile& file, std::size_t node);

/// Converts a camera node to a view, without the scale of its transform. A camera without a name is called
/// "view<number>". Throws Error(Work).
View convert_camera(const GltfFile& file, std::size_t node, const glm::dmat4& world_from_node, std::size_t number);

}  // namespace ballot
