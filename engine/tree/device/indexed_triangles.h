// The triangles of meshes whose vertices move, written on the device: of vertices that the host sends, or that are
// there.
#pragma once

#include <map>
#include <memory>
#include <optional>

#include "engine/gpu/kernel.h"
#include "engine/tree/device/device_vertices.h"
#include "shaders/shared/pose.h"

namespace ballot {

/// A mesh whose vertices have moved.
struct MovedVertices {
  std::size_t first = 0, triangles = 0;  // its triangles in the scene, or in those of one tree
  /// Three vertices for each triangle, the same numbers at every call; none: vertices 0 1 2, 3 4 5, ...
  std::span<const std::uint32_t> corners;
  std::span<const glm::vec3> positions;      // all vertices of the mesh
  std::size_t mesh = 0;                      // of the scene
  std::uint32_t number = 0;                  // by which its caller names it
  std::optional<DeviceVertices> there = {};  // instead of positions
  /// Instead of corners, in a buffer that kernels can read. Whoever has this keeps it.
  std::shared_ptr<const RawBuffer> corners_there = {};

  bool indexed() const { return corners_there || !corners.empty(); }
  std::size_t vertex_count() const { return there ? std::size_t(there->count) : positions.size(); }
};

/// Writes the triangles of a tree, as a build or a refit has them (DeviceBuild), from vertices. Takes 36 bytes a
/// triangle of the tree; of each mesh that has moved 12 a triangle with indices, and 12 a vertex that the host has
/// sent. Belongs to the thread of its Context.
class IndexedTriangles {
 public:
  /// `triangles`: of the tree. Throws Error(Work) if the device has no room.
  IndexedTriangles(Context& gpu, std::size_t triangles);

  /// Records that the triangles of meshes are written into triangles(), and those of all others that `now` has. The
  /// meshes are named by their first triangles in the tree. Uploads vertices of the host, which waits. Throws
  /// Error(Work) if the device fails.
  void record(std::span<const MovedVertices> meshes, const Buffer<Triangle>& now);

  /// What the device has found of a mesh.
  struct Found {
    std::optional<std::uint32_t> first_bad;  // the first vertex with a coordinate that is not finite or beyond +-1e12
    std::optional<std::uint32_t> first_bad_corner;  // the place of the first index of no vertex
    MeshExtents extents;                            // unless there is one; of all triangles
  };
  /// Returns what it has found of each mesh of the last record(). Waits.
  std::vector<Found> found();

  /// Returns the buffer that record() writes. It may be swapped for another one with triangles of another time.
  Buffer<Triangle>& triangles() { return triangles_; }

 private:
  /// What the device keeps of a mesh.
  struct Kept {
    std::optional<Buffer<std::uint32_t>> corners;
    std::optional<Buffer<glm::vec3>> positions;
  };
  void make_room(std::size_t meshes);
  void upload(const MovedVertices& mesh);
  void dispatch(Commands& cmd, const MovedVertices& mesh, std::size_t number);

  Context& gpu_;
  Buffer<Triangle> triangles_;
  const std::uint64_t state_bytes_;                 // from one PoseState to the next
  std::size_t meshes_ = 0;                          // of the last record()
  std::optional<Buffer<std::byte>> states_, told_;  // of each mesh; the host's copy, where it does not see the first
  std::map<std::size_t, Kept> kept_;                // by the first triangle
  std::unique_ptr<Kernel> kernels_[2];              // of vertices in turn, of indices
};

/// Throws the error that the host has of an index or a vertex that the device refuses, if it has found one: it begins
/// with `where`.
void check_found(const MovedVertices& mesh, const IndexedTriangles::Found& found, const std::string& where,
                 const DeviceInfo& device);

/// The triangles of all meshes of a scene, on its device.
struct TrianglesThere {
  Buffer<Triangle> triangles;
  std::vector<MeshExtents> meshes;  // of each mesh
  bool on_host = false;             // the scene has them as well
};

/// Returns the sources of the kernels, for compiling them ahead.
std::vector<KernelSource> indexed_triangle_sources();

/// Returns the state of kernels that find bounds before they have seen any triangle, and the bounds that it tells
/// afterwards; nothing if a coordinate leaves the range of scenes.
PoseState empty_pose_state();
std::optional<Bounds> bounds_of(const PoseState& state);

}  // namespace ballot
