// Tables of the handles that the C interface gives out. A handle is a number that is never given out twice, so one that
// is closed is known to be so.
#pragma once

#include <cstdint>
#include <memory>
#include <shared_mutex>
#include <unordered_map>

namespace ballot::api {

/// Returns a number that no handle has had.
std::uintptr_t next_handle();

/// The open handles of one kind, and what stands behind each. Thread-safe.
template <class Handle, class State>
class Handles {
 public:
  Handle* add(std::shared_ptr<State> state) {
    const std::uintptr_t number = next_handle();
    const std::unique_lock lock(mutex_);
    states_.emplace(number, std::move(state));
    return reinterpret_cast<Handle*>(number);
  }
  /// Returns null if the handle is closed or none.
  std::shared_ptr<State> find(const Handle* handle) const {
    const std::shared_lock lock(mutex_);
    const auto found = states_.find(reinterpret_cast<std::uintptr_t>(handle));
    return found == states_.end() ? nullptr : found->second;
  }
  /// Closes the handle and returns what stood behind it, or null.
  std::shared_ptr<State> remove(const Handle* handle) {
    const std::unique_lock lock(mutex_);
    const auto node = states_.extract(reinterpret_cast<std::uintptr_t>(handle));
    return node.empty() ? nullptr : std::move(node.mapped());
  }

 private:
  mutable std::shared_mutex mutex_;
  std::unordered_map<std::uintptr_t, std::shared_ptr<State>> states_;
};

}  // namespace ballot::api
