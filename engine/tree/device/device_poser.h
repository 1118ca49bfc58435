// Poses the vertices of skinned and morphed meshes on the device.
#pragma once

#include <algorithm>
#include <memory>

#include "engine/gpu/kernel.h"
#include "engine/model/pose.h"
#include "shaders/shared/pose.h"

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

  /// Records the same, into posed(). Waits for earlier passes.
  void record(const PoseInput& input);
  const Buffer<PosedVertex>& posed() const;
  /// Return the vertices of all meshes that move, as Animation has them.
  const Buffer<glm::vec3>& positions() const;
  const Buffer<glm::vec3>& normals() const;

 private:
  struct Memory;
  Context& gpu_;
  std::unique_ptr<Memory> memory_;
  std::unique_ptr<Kernel> kernel_;
  std::uint32_t vertices_;
};

/// Returns the workgroups of a kernel of shaders/pose/ over this many items: enough to fill a GPU, as each adds what it
/// has found to the same few words.
inline std::uint32_t pose_groups(const DeviceInfo& device, std::uint32_t items) {
  constexpr std::uint32_t kMost = 4096;
  return std::min({groups_of(items, POSE_GROUP), kMost, device.max_group_count_x});
}

/// Records such a kernel.
template <class Push>
void run_pose(Context& gpu, Kernel& kernel, std::uint32_t items, const Push& push) {
  if (items == 0) return;
  gpu.pass(kernel.name(), [&](Commands& cmd) { kernel.dispatch(cmd, pose_groups(gpu.info(), items), push); });
}

/// Returns the source of the kernel.
KernelSource pose_source();

}  // namespace ballot
