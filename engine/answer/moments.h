// What winding numbers need of a tree's nodes that are far from a point. Internal to engine/answer.
#pragma once

#include <glm/vec4.hpp>
#include <memory>
#include <vector>

#include "engine/gpu/room.h"
#include "engine/tree/device/device_tree.h"
#include "shaders/shared/query.h"

namespace ballot {

/// Returns the moments of a tree's nodes (BIND_NODE_MOMENTS in shaders/shared/query.h), computed in double, behind a
/// header that is zero. Each triangle lies in one leaf.
std::vector<glm::vec4> moments_of(const Bvh& bvh, std::span<const Triangle> triangles);

/// Those of a tree on the device: 160 bytes a leaf. Belongs to the thread of its Context.
class Moments {
 public:
  explicit Moments(Context& gpu) : gpu_(gpu) {}
  /// Makes them if they are not those of the tree as it is now, and sets the opening ratio.
  const RawBuffer& update(DeviceTree& tree, float beta);

 private:
  Context& gpu_;
  std::uint64_t generation_ = 0;  // of the tree
  float beta_ = 0;
  std::unique_ptr<Buffer<glm::vec4>> device_;
};

}  // namespace ballot
