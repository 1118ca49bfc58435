// What of a scene has moved elsewhere, and has not been brought back. No Vulkan.
#pragma once

#include <functional>
#include <utility>

namespace ballot {

/// Tells whether the host's triangles, normals, placements and bounds of a scene are those of an earlier time, and
/// brings them up to date. Whoever reads them on the host calls bring() first. Belongs to the thread of its
/// DeviceScene.
class HostVertices {
 public:
  /// Brings the vertices back if they are late. Throws what doing so throws; they are late then still.
  void bring() const {
    if (!fetch_) return;
    const auto fetch = std::exchange(fetch_, nullptr);
    try {
      fetch();
    } catch (...) {
      fetch_ = fetch;
      throw;
    }
  }
  /// Tells that the vertices have moved elsewhere; `fetch` brings them here.
  void are_there(std::function<void()> fetch) { fetch_ = std::move(fetch); }

 private:
  mutable std::function<void()> fetch_;
};

}  // namespace ballot
