// Where the transforms of a forest's instances come from.
#pragma once

#include <memory>
#include <span>

#include "engine/gpu/buffer.h"
#include "engine/model/placement.h"

namespace ballot {

/// Transforms, one for each instance: on the host or on the device; without either the instances stay where they are.
struct MovedTransforms {
  MovedTransforms() = default;
  MovedTransforms(std::span<const Transform> transforms) : here(transforms) {}
  MovedTransforms(const std::vector<Transform>& transforms) : here(transforms) {}
  explicit MovedTransforms(std::shared_ptr<const RawBuffer> buffer) : there(std::move(buffer)) {}

  std::span<const Transform> here = {};
  /// With Access::Storage. Whoever writes them must have ended, or be recorded in the buffer's Context.
  std::shared_ptr<const RawBuffer> there = {};

  bool stay() const { return here.data() == nullptr && !there; }
};

/// Returns the first `count` transforms of a buffer, read back. Waits for the device.
inline std::vector<Transform> read_transforms(const RawBuffer& there, std::size_t count) {
  std::vector<Transform> read(count);
  there.download(0, read.data(), count * sizeof(Transform));
  return read;
}

}  // namespace ballot
