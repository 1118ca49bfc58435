// Poses the vertices of skinned and morphed meshes on the device.
#pragma once

#include <memory>

#include "engine/scene/pose.h"
#include "engine/vk/kernel.h"

namespace ballot {

/// Holds the moving vertices of an animation on a device: per posed vertex up to 60 bytes and 24 for each morph target.
/// Belongs to the thread of its Context.
class DevicePoser {
 public:
  /// Uploads the vertices. Throws Error(Work) if the device has no room.
  DevicePoser(Context& gpu, const Animation& animation);
  ~DevicePoser();

  /// Does what pose_vertices() does, with the same bits, and waits for it. Throws Error(Work) if the device fails.
  void pose(const PoseInput& input, std::span<PosedVertex> posed);

  /// Device milliseconds of the last pose().
  double ms() const { return ms_; }

 private:
  struct Memory;
  Context& gpu_;
  std::unique_ptr<Memory> memory_;
  std::unique_ptr<Kernel> kernel_;
  std::uint32_t vertices_;
  double ms_ = 0;
};

/// Returns the source of the kernel.
KernelSource pose_source();

}  // namespace ballot
