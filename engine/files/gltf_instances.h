// The glTF extension EXT_mesh_gpu_instancing: a node places its mesh many times. Internal to engine/files.
#pragma once

#include <glm/mat4x4.hpp>
#include <optional>

#include "engine/files/gltf_accessor.h"

namespace ballot {

/// The instances of a node. Valid as long as its file.
class NodeInstances {
 public:
  std::size_t size() const { return count_; }
  /// Returns the matrix from instance i to the node: translation, rotation and scale, of which any may be missing.
  glm::dmat4 matrix(std::size_t i) const;

 private:
  friend std::optional<NodeInstances> open_instances(const GltfFile& file, std::size_t node);

  std::size_t count_ = 0;
  std::optional<AccessorView> translations_, rotations_, scales_;
};

/// Checks the extension of a node and opens its accessors. Returns nothing if the node has none. Throws Error(Work) if
/// it has no attribute, if the numbers of their elements disagree, or if an accessor is wrong.
std::optional<NodeInstances> open_instances(const GltfFile& file, std::size_t node);

}  // namespace ballot
