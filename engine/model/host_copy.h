// What the host has of a scene that lies elsewhere too, and whether that is true. No Vulkan.
#pragma once

#include <functional>
#include <utility>
#include <vector>

#include "engine/core/interruption.h"

namespace ballot {

/// Tells whether what the host has of a scene, or of one of its trees, is that of an earlier time, or gone, and makes
/// it true. Of a scene: triangles, normals, placements and bounds. Of a tree: its triangles and nodes. Whoever reads
/// them on the host calls bring() first, and then they stay. Belongs to the thread of its DeviceScene.
class HostCopy {
 public:
  /// Makes the copy true, and those that are part of it. Throws what doing so throws; it is late then still.
  void bring() const {
    stays_ = true;
    bring_briefly();
  }
  /// The same for one who does not read it later. Then it may go.
  void bring_briefly() const {
    for (const HostCopy& part : parts) stays_ ? part.bring() : part.bring_briefly();
    if (!fetch_) return;
    ask_interruption();
    const auto fetch = std::exchange(fetch_, nullptr);
    try {
      fetch();
    } catch (...) {
      fetch_ = fetch;
      throw;
    }
  }
  bool may_go() const { return !stays_ && !fetch_; }
  /// Returns true if the host has not what the copy is of; nothing is said of its parts.
  bool is_late() const { return fetch_ != nullptr; }
  /// Tells that the copy is late, or gone; `fetch` makes it true.
  void is_elsewhere(std::function<void()> fetch) { fetch_ = std::move(fetch); }

  std::vector<HostCopy> parts;

 private:
  mutable std::function<void()> fetch_;
  mutable bool stays_ = false;
};

}  // namespace ballot
