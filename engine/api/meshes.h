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

/// Throws Refused unless a mesh names its vertices once, its indices once or not at all, and enough of each for its
/// shapes. `where` begins the text.
void check_mesh(const BallotMesh& m, const std::string& where);

/// Vectors that lie one behind the other, in the caller's memory or gathered from there.
struct DenseVertices {
  /// `stride`: bytes from one to the next, as vertex_stride() returns it.
  DenseVertices(const float* from, std::size_t stride, std::size_t count);
  DenseVertices() = default;
  DenseVertices(DenseVertices&&) = default;  // `all` stays what it is
  DenseVertices& operator=(DenseVertices&&) = default;
  std::vector<glm::vec3> gathered;
  std::span<const glm::vec3> all;
};

/// The arrays on the device that a caller's mesh names; null: it has none. They go once the call has let go of the
/// device: the last reference to an array takes the device to destroy it.
struct MeshBuffers {
  /// `where` begins the text of errors.
  MeshBuffers(const BallotMesh& m, const std::string& where);
  std::shared_ptr<BufferState> vertices, indices;
  std::vector<std::shared_ptr<BufferState>> attributes;  // of each attribute
  /// Returns true if the device makes the triangles.
  explicit operator bool() const { return vertices || indices; }
  /// Returns true if the device has to be held to read the mesh.
  bool needs_device() const { return *this || !attributes.empty(); }
};

/// Checks a mesh and reads its triangles and attributes. Triangles of arrays on the device are made there, and stay
/// `there` unless the mesh has normals. The device is held. Vertices are counted from `origin`. Throws Refused, which
/// begins with `where`.
struct GivenMesh {
  MeshState state;
  MeshGeometry geometry;
  std::shared_ptr<TrianglesThere> there = {};
};
GivenMesh read_mesh(const BallotMesh& m, const MeshBuffers& from, const SceneState& scene, const glm::dvec3& origin,
                    const std::string& where);

/// Has the device make the triangles of a mesh of vertices that lie there, and writes its bounds. The device is held.
/// Throws as read_mesh() does.
std::shared_ptr<TrianglesThere> move_there(MeshState& mesh, const DeviceVertices& vertices, const SceneState& scene,
                                           const std::string& where);
/// Has the host have the triangles of a mesh.
void bring_triangles(MeshGeometry& mesh, const TrianglesThere& there);

/// The indices of a mesh: those of its state, or made of its heights.
struct MeshIndices {
  std::vector<std::uint32_t> made;
  std::span<const std::uint32_t> all;
};
/// Returns them, read back if the host has not had them yet. The device is held.
MeshIndices indices_of(MeshState& mesh);

/// Throws Refused if a scene has too many triangles. `where` begins the text.
void check_triangle_count(std::size_t triangles, const std::string& where);

/// A scene of meshes, which the caller finishes, and where its triangles are if one of the meshes names arrays on the
/// device; null: the host has them.
struct GivenScene {
  Scene scene;
  std::shared_ptr<TrianglesThere> there;
};
/// Checks meshes and returns a scene of them. Writes their states by number. The device is held if one of them needs
/// it: `from` has the arrays of each mesh there. Throws Refused, which names the mesh.
struct Origins;  // origins.h
GivenScene read_meshes(const BallotMesh* meshes, std::span<const MeshBuffers> from, const Origins& origins,
                       SceneState& scene);

/// Has the host have the triangles as well.
void bring_triangles(GivenScene& given);

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
