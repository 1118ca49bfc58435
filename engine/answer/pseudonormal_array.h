// The pseudonormals of a tree's triangles, or of a forest's where its instances move them, on the host and on the
// device. Internal to engine/answer.
#pragma once

#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <vector>

#include "engine/core/interruption.h"
#include "engine/tree/device/device_tree.h"
#include "engine/tree/host/moved_corners.h"
#include "engine/tree/host/pseudonormals.h"

namespace ballot {

/// Belongs to the thread of its Context.
class PseudonormalArray {
 public:
  /// Makes the vectors if they are not those of the tree as it is now. Throws Error(Work) if they do not fit into the
  /// device's memory: 72 bytes a triangle. The caller is asked first then (ask_interruption()).
  const PseudonormalArray& update(Context& gpu, DeviceTree& tree) {
    if (device_ && generation_ == tree.generation()) return *this;
    ask_interruption();
    device_.reset();
    tree.bring_triangles();
    host_ = tree.forest() ? pseudonormals_of(moved_triangles(*tree.forest())) : pseudonormals_of(tree.triangles());
    device_.emplace(gpu, host_.size(), Access::Storage, "pseudonormals");
    device_->upload(host_);
    generation_ = tree.generation();
    return *this;
  }
  const RawBuffer& device() const { return *device_; }
  std::span<const glm::vec3> all() const { return host_; }
  std::span<const glm::vec3, PSEUDONORMALS> of(std::uint32_t prim) const {
    return std::span(host_).subspan(PSEUDONORMALS * std::size_t(prim)).first<PSEUDONORMALS>();
  }

 private:
  std::uint64_t generation_ = 0;  // of the tree
  std::vector<glm::vec3> host_;
  std::optional<Buffer<glm::vec3>> device_;
};

}  // namespace ballot
