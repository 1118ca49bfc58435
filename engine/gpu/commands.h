// The commands of a pass. Other rooms record them without Vulkan's own types.
#pragma once

#include <cstdint>
#include <type_traits>

#include "engine/gpu/api.h"

namespace ballot {

class RawBuffer;

/// What a pass consists of: Context::pass() hands it to the function that records the pass, and it is valid until that
/// returns. Kernels are dispatched with it (kernel.h). Commands of a pass may run at the same time; barrier() orders
/// them.
class Commands {
 public:
  /// Keeps a reference to the functions.
  Commands(const Vulkan& vk, VkCommandBuffer handle) : vk_(vk), handle_(handle) {}

  /// Makes writes of earlier dispatches and copies visible to later dispatches, to their indirect arguments, and to
  /// copies.
  void barrier();
  /// Writes a number to every 32-bit word of a buffer, or of `bytes` of it from `offset` on; both are multiples of 4.
  void fill(const RawBuffer& buffer, std::uint32_t word);
  void fill(const RawBuffer& buffer, std::uint64_t offset, std::uint64_t bytes, std::uint32_t word);
  /// Writes bytes that the host has now: at most 65536; their number and `offset` are multiples of 4.
  void write(const RawBuffer& buffer, std::uint64_t offset, const void* data, std::uint64_t bytes);
  /// Writes a record at the beginning of a buffer.
  template <class T>
  void write(const RawBuffer& buffer, const T& record) {
    static_assert(std::is_trivially_copyable_v<T>, "the device sees bytes, not objects");
    write(buffer, 0, &record, sizeof record);
  }
  /// Copies the first bytes of a buffer to the beginning of another.
  void copy(const RawBuffer& from, const RawBuffer& to, std::uint64_t bytes);

  VkCommandBuffer handle() const { return handle_; }

 private:
  const Vulkan& vk_;
  VkCommandBuffer handle_;
};

}  // namespace ballot
