// The triangles of meshes whose vertices move, written on the device: the host sends vertices, not corners.
#pragma once

#include <map>
#include <memory>
#include <optional>

#include "engine/gpu/kernel.h"
#include "engine/tree/host/instance.h"
#include "shaders/shared/pose.h"

namespace ballot {

/// A mesh whose vertices have moved.
struct MovedVertices {
  std::size_t first = 0, triangles = 0;  // its triangles in the scene, or in those of one tree
  /// Three vertices for each triangle, the same numbers at every call; none: vertices 0 1 2, 3 4 5, ...
  std::span<const std::uint32_t> corners;
  std::span<const glm::vec3> positions;
  std::size_t mesh = 0;      // of the scene
  std::uint32_t number = 0;  // by which its caller names it
};

/// Writes the triangles of a tree, as a build or a refit has them (DeviceBuild), from vertices. Takes 36 bytes a
/// triangle of the tree; of each mesh that has moved 12 a triangle with indices and 12 a vertex. Belongs to the thread
/// of its Context.
class IndexedTriangles {
 public:
  /// `triangles`: of the tree. Throws Error(Work) if the device has no room.
  IndexedTriangles(Context& gpu, std::size_t triangles);

  /// Writes into triangles() those of a mesh, and of all others what `now` has, and waits. null: triangles() has the
  /// others. Returns the extents
  /// of the mesh, all of whose vertices count; nothing if a coordinate is not finite or beyond +-1e12. Throws
  /// Error(Work) if the device fails.
  std::optional<MeshExtents> write(const MovedVertices& mesh, const Buffer<Triangle>* now);

  /// Returns the buffer that write() writes. It may be swapped for another one with triangles of another time.
  Buffer<Triangle>& triangles() { return triangles_; }

 private:
  /// What the device keeps of a mesh.
  struct Mesh {
    Buffer<std::uint32_t> corners;
    Buffer<glm::vec3> positions;
  };
  Mesh& mesh_of(const MovedVertices& mesh);

  Context& gpu_;
  Buffer<Triangle> triangles_;
  Buffer<PoseState> state_;
  std::map<std::size_t, Mesh> meshes_;  // by the first triangle
  std::unique_ptr<Kernel> kernels_[2];  // of vertices in turn, of indices
};

/// Returns the sources of the kernels, for compiling them ahead.
std::vector<KernelSource> indexed_triangle_sources();

/// Returns the state of kernels that find bounds before they have seen any triangle, and the bounds that it tells
/// afterwards; nothing if a coordinate leaves the range of scenes.
PoseState empty_pose_state();
std::optional<Bounds> bounds_of(const PoseState& state);

}  // namespace ballot
