// Meshes in a caller's memory: checked, and read into triangles.
#pragma once

#include "engine/api/state.h"
#include "engine/model/mesh_vertices.h"

namespace ballot::api {

/// Returns the bytes from one vertex to the next, as stride_of() does for any array.
inline std::size_t vertex_stride(std::size_t given, std::size_t count, const std::string& where) {
  return stride_of(given, 3 * sizeof(float), count, where);
}

/// Throws Refused unless there can be so many structs one after the other.
void check_mesh_count(const BallotMesh* meshes, std::size_t count);

/// Vectors that lie one behind the other, in the caller's memory or gathered from there.
struct DenseVertices {
  /// `stride`: bytes from one to the next, as vertex_stride() returns it.
  DenseVertices(const float* from, std::size_t stride, std::size_t count);
  std::vector<glm::vec3> gathered;
  std::span<const glm::vec3> all;
};

/// A mesh that a caller gave.
struct GivenMesh {
  MeshState state;
  MeshGeometry geometry;
};
/// Returns the shapes of a mesh whose vertices lie at these positions.
std::vector<ballot::Shape> shapes_at(const MeshState& mesh, std::span<const glm::vec3> positions,
                                     const std::string& where);
/// Checks a mesh and reads its triangles. Throws Refused, which begins with `where`.
GivenMesh read_mesh(const BallotMesh& m, const std::string& where);

/// Throws Refused if a scene has too many triangles. `where` begins the text.
void check_triangle_count(std::size_t triangles, const std::string& where);

/// Checks meshes and returns a scene of them, which the caller finishes. Writes their states by number. Throws Refused,
/// which names the mesh.
Scene read_meshes(const BallotMesh* meshes, std::size_t count, std::map<std::uint32_t, MeshState>& states);

/// Checks instances and returns them. Throws Refused.
std::vector<Placement> read_instances(const BallotInstances& given);

/// Returns the bounds of a mesh, by its index, in its own space. The device's mutex is held.
Bounds bounds_of(SceneState& scene, std::size_t mesh);

/// Throws Refused if animations move the scene: setting a time would undo what else moves. `call` begins the text.
void refuse_animated(const SceneState& scene, const char* call);

/// Returns mesh number i of an array of structs. Field `size` of the first tells how large each is.
BallotMesh mesh_struct(const BallotMesh* meshes, std::size_t i);

/// Returns the options of an engine or of the trees of meshes. `builder`: the default.
DeviceSceneOptions scene_options(const DeviceState& device, const BallotSceneOptions& o, const char* builder,
                                 bool cache);

}  // namespace ballot::api
