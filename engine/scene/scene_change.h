// A change of a scene on a device that becomes true as a whole.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>

#include "engine/model/scene_edits.h"
#include "engine/tree/device/device_tree.h"
#include "engine/tree/device/indexed_triangles.h"

namespace ballot {

/// Triangles of single meshes on the device, by the meshes' numbers.
using TrianglesOfMeshes = std::map<std::uint32_t, std::shared_ptr<TrianglesThere>>;

/// What DeviceScene::commit() makes true.
struct SceneChange {
  std::optional<SceneStructure> structure = {};  // none: meshes and placements stay, and what follows moves them
  TrianglesOfMeshes there = {};                  // of meshes of the structure that lie elsewhere and are new; are taken
  std::span<const MovedVertices> vertices = {};  // of meshes whose trees hold no others, or of a flat scene
  MovedTransforms transforms = {};               // of all placements; on the device if reads_transforms_there()
  std::span<const std::uint32_t> masks = {};     // of all placements, as hides_or_shows() is false for; none: they stay
};

}  // namespace ballot
