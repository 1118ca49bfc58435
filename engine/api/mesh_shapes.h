// Shapes other than triangles in a caller's meshes: checked, and read.
#pragma once

#include "engine/api/state.h"
#include "engine/model/shapes.h"

namespace ballot::api {

/// Returns the row of what a mesh is made of. Throws Refused, which begins with `where`, unless it has radii,
/// normals and heights as its shapes do, and what is no mesh of vertices and indices lies in the host's memory.
const ShapeInfo& shapes_of(const BallotMesh& m, const std::string& where);

/// Returns the radius of each vertex of a mesh; none if it has none. Throws Refused for a wrong stride.
std::vector<float> read_radii(const BallotMesh& m, const std::string& where);

/// Returns the shapes of a mesh whose vertices lie at these positions. Throws as make_shapes() does.
std::vector<ballot::Shape> shapes_at(const MeshState& mesh, std::span<const glm::vec3> positions,
                                     const std::string& where);

/// Returns the state of mesh `mesh` of a file, whose vertices are those of its triangles or shapes in turn, or the
/// samples of its heights.
MeshState state_of_file(const ballot::Scene& scene, std::size_t mesh);

}  // namespace ballot::api
