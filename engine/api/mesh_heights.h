// Meshes of heights in a caller's memory: checked, and read.
#pragma once

#include "engine/api/meshes.h"
#include "engine/model/heights.h"

namespace ballot::api {

/// Throws Refused or Error(Arguments), which begin with `where`, unless a mesh of heights has a grid, and neither
/// vertices nor indices.
void check_raster(const BallotMesh& m, const std::string& where);

/// Returns the heights of a mesh. Throws as check_raster(), and for a height or a stride that cannot be.
std::shared_ptr<const HeightField> read_heights(const BallotMesh& m, const std::string& where);

/// Returns vertices that move: those of other heights of the same grid. `stride` in bytes; 0: side by side. Throws
/// Refused unless the mesh is of so many heights, or as read_heights().
PendingEdits::Vertices moved_heights(const MeshState& mesh, const float* heights, std::size_t count, std::size_t stride,
                                     std::uint32_t number);

/// Throws Refused if a mesh is of heights, whose vertices move by these alone.
void refuse_heights(const MeshState& mesh, std::uint32_t number);

}  // namespace ballot::api
