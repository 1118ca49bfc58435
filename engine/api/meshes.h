// Meshes in a caller's memory: checked, and read into triangles.
#pragma once

#include "engine/api/state.h"

namespace ballot::api {

/// Throws Refused(BALLOT_ERROR_ARGUMENT).
[[noreturn]] void refuse(const std::string& text);

/// Returns the bytes from one vertex to the next. Throws Refused, which begins with `where`, if they are too few.
std::size_t stride_of(std::size_t given, const std::string& where);

/// Throws Refused, which names the vertex, if a coordinate is not finite or beyond 1e12.
void check_vertices(const float* positions, std::size_t stride, std::size_t count, const std::string& where);

/// Checks a mesh and returns its part of the scene, which begins with triangle `first`. Throws Refused.
MeshState read_mesh(const BallotMesh& m, std::size_t first, const std::string& where);

/// Writes three vectors for each triangle of a mesh.
void gather(const MeshState& mesh, const float* from, std::size_t stride, std::array<glm::vec3, 3>* to);

/// Returns mesh number i of an array of structs. Field `size` of the first tells how large each is.
BallotMesh mesh_struct(const BallotMesh* meshes, std::size_t i);

/// Returns the options of an engine or of the trees of meshes. `builder`: the default.
EngineOptions engine_options(const DeviceState& device, const BallotSceneOptions& o, const char* builder, bool cache);

}  // namespace ballot::api
