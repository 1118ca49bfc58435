// The triangles of an animated scene that are posed on the device and stay there.
#pragma once

#include <memory>
#include <optional>

#include "engine/model/scene.h"
#include "engine/tree/device/device_poser.h"

namespace ballot {

/// Moves the triangles of a scene on the device: from a pose of the nodes to triangles as a tree build or a refit has
/// them (DeviceBuilder), and to what shading reads of them. Vertices have the bits of pose_at(). Takes 12 bytes a
/// triangle that moves, 28 for each vertex of parts that move as a whole, and 36 for each triangle of the scene, beside
/// the DevicePoser. Belongs to the thread of its Context.
class PosedTriangles {
 public:
  /// Returns true if the device can: it needs float64.
  static bool runs_on(const DeviceInfo& device) { return device.float64; }

  /// Keeps references to gpu, poser and the scene's animation. `now` holds the scene's triangles; those that do not
  /// move are taken from it. Throws Error(Work) if the device has no room.
  PosedTriangles(Context& gpu, const Scene& scene, DevicePoser& poser, const Buffer<Triangle>& now);
  ~PosedTriangles();

  /// Poses all triangles into triangles(), and waits. Returns their bounds; nothing if a coordinate is not finite or
  /// beyond +-1e12. Throws Error(Work) if the device fails.
  std::optional<Bounds> pose(const NodePose& nodes);

  /// Returns the buffer that pose() writes. It may be swapped for another one with the triangles of another time.
  Buffer<Triangle>& triangles() { return *triangles_; }

  /// Record that the vertices of the last pose are written into the texels that shading reads (SceneData); without
  /// `normals` the scene has none.
  void write(Buffer<glm::uvec4>& triangles, Buffer<glm::uvec4>* normals);

 private:
  struct Memory;
  struct Kernels;
  void upload_places(const NodePose& nodes);
  void place();

  Context& gpu_;
  const Animation& animation_;
  DevicePoser& poser_;
  std::optional<Bounds> still_;                        // of the triangles that do not move
  std::uint32_t parts_ = 0, placed_ = 0, moving_ = 0;  // parts and triangles that move, vertices that are placed
  std::unique_ptr<Memory> memory_;
  std::unique_ptr<Kernels> kernels_;
  std::optional<Buffer<Triangle>> triangles_;
};

/// Return the sources of the kernels, for compiling them ahead.
std::vector<KernelSource> posed_triangle_sources();

}  // namespace ballot
