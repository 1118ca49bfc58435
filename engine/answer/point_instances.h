// The instances of a forest as the kernel of closest points reads them. Internal to engine/answer.
#pragma once

#include <glm/vec4.hpp>
#include <optional>
#include <vector>

#include "engine/tree/device/device_tree.h"

namespace ballot {

/// Returns the records of all instances (BIND_POINT_INSTANCES in shaders/shared/query.h). Uses all cores.
std::vector<glm::vec4> point_records(const Forest& forest);

/// Belongs to the thread of its Context.
class PointInstances {
 public:
  /// Makes the records anew if they are not those of the forest as it is now, for a kernel that reads in this way.
  void update(Context& gpu, const DeviceTree& tree, Fetch fetch);
  const RawBuffer& device() const { return *device_; }

 private:
  std::uint64_t generation_ = 0;  // of the forest
  Fetch fetch_ = Fetch::Storage;
  std::optional<Buffer<glm::vec4>> device_;
};

}  // namespace ballot
