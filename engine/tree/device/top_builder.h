// The top-level tree of a forest, on the device: instances are placed there, and the tree over them is built and
// refitted.
#pragma once

#include <glm/vec2.hpp>

#include "engine/tree/device/device_builder.h"
#include "engine/tree/device/moved_transforms.h"
#include "engine/tree/host/forest.h"

namespace ballot {

/// Keeps a top-level tree on a device. A frame uploads transforms, 48 bytes an instance, unless they are there, and
/// reads back what TopFacts holds. Records of instances have the bits of the host's; the tree is H-PLOC's
/// (shaders/build/cluster.comp), whose shape differs from the host's. No hit depends on that. It takes 190 bytes an
/// instance beside the tree. Belongs to the thread of its Context.
class TopBuilder {
 public:
  using Texels = Buffer<glm::uvec4>;

  /// Returns true if the device can do it: that takes float64 and what DeviceBuilder does.
  static bool runs_on(const DeviceInfo& device) { return device.float64 && DeviceBuilder::runs_on(device); }

  /// Keeps references. The forest's meshes and its instances' numbers stay as they are.
  TopBuilder(Context& gpu, const Forest& forest);

  /// Returns the texels of the tree: room for a node an instance, then the records.
  std::size_t texels() const { return forest_.size() * (TOP_NODE_TEXELS + INSTANCE_TEXELS); }

  /// Places the instances by transforms, one for each, and refits the tree in `tops`, or builds it: at the first call,
  /// and once refits have raised its cost to kMostTopDecay. Each buffer has texels() texels and can be written by
  /// kernels. Transforms that stay are those of the last call; there must have been one. Throws Error(Arguments) as
  /// place_instance() does, of the first instance that cannot be placed; the buffers then hold the tree that they held
  /// before, or nothing at the first call. Throws Error(Work) if the device fails.
  TopFacts move(const MovedTransforms& transforms, std::span<Texels* const> tops);
  /// Writes the transforms of the last move(), one for each instance. Waits for the device.
  void read(std::span<Transform> transforms) const { transforms_[now_].download(transforms); }
  /// Takes another mesh of the forest in the place of one. move() must follow.
  void exchanged(std::size_t mesh);
  /// Writes the tree of the last move() into another buffer.
  void write(Texels& top);

  /// Device milliseconds of the passes of the last move().
  double move_ms() const;

 private:
  void send(const MovedTransforms& transforms);
  void record_place(Texels& top);
  void record_nodes(Texels& top);
  bool refit(Texels& top);
  void build(Texels& top);
  [[noreturn]] void refuse(const Transform& transform, std::uint32_t instance) const;
  std::uint32_t root() const;
  void find_first();
  std::uint32_t count() const { return std::uint32_t(forest_.size()); }

  Context& gpu_;
  const Forest& forest_;
  PassMs own_ms_;  // written by passes that may end as late as the buffers below
  DeviceBuilder builder_;
  Kernel instances_, nodes_;
  Buffer<Transform> transforms_[2];  // of the last move, and of the one before or under way
  Buffer<Transform> sent_;           // in memory of the host, if those are not
  std::size_t now_ = 0;              // which of the two the tree is of
  Buffer<glm::uvec2> parts_;
  Buffer<MeshExtent> meshes_;
  std::vector<bool> empty_;  // of each mesh: it cannot be hit
  std::uint32_t only_ = 0;   // the first instance that can be hit
  bool built_ = false;
  double built_cost_ = 0;
};

}  // namespace ballot
