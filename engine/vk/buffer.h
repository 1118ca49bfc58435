// Typed, owned device buffers.
#pragma once

#include <cstring>
#include <span>
#include <type_traits>
#include <utility>

#include "engine/vk/context.h"

namespace ballot {

/// How kernels read a buffer; more than one may be asked for. Decides usage flags and limits. On CPU devices a storage buffer
/// is a texel buffer too, where it is not too large for one. Groups: dispatches read how many groups they have from it. Host:
/// it lies in the host's memory, for few words that the device writes and the host reads.
enum class Access : std::uint32_t { Storage = 1, Texel = 2, Address = 4, Groups = 8, Host = 16 };
constexpr Access operator|(Access a, Access b) { return Access(std::uint32_t(a) | std::uint32_t(b)); }
constexpr bool has(Access set, Access one) { return (std::uint32_t(set) & std::uint32_t(one)) != 0; }

/// Bytes on the device, with a texel view (R32G32B32A32_UINT) and an address where asked for. Use Buffer<T>.
class RawBuffer {
 public:
  /// Throws Error(Work) that names the buffer, its size and the limit: maxStorageBufferRange, maxTexelBufferElements,
  /// maxMemoryAllocationSize, or the heap. At least 16 bytes are allocated, so an empty buffer can be bound.
  RawBuffer(Context& gpu, std::uint64_t bytes, Access access, std::string name);
  ~RawBuffer();
  RawBuffer(RawBuffer&& other) noexcept { *this = std::move(other); }
  RawBuffer& operator=(RawBuffer&& other) noexcept;

  /// Both wait for all passes (context.h).
  void upload(std::uint64_t offset, const void* data, std::uint64_t bytes);
  void download(std::uint64_t offset, void* data, std::uint64_t bytes) const;
  /// Copies bytes of another buffer on the device.
  void copy_from(const RawBuffer& other, std::uint64_t other_offset, std::uint64_t offset, std::uint64_t bytes);

  std::uint64_t bytes() const { return bytes_; }
  const std::string& name() const { return name_; }
  VkBuffer handle() const { return buffer_; }
  VkBufferView view() const { return view_; }
  std::uint64_t address() const { return address_; }
  /// No other buffer of the context ever has it.
  std::uint64_t id() const { return id_; }
  /// What passes that have ended wrote; null unless the buffer lies in the host's memory.
  const std::byte* mapped() const { return mapped_; }

 private:
  void allocate(Access access);
  void destroy();
  void copy(std::uint64_t offset, void* to, const void* from, std::uint64_t bytes) const;

  Context* gpu_ = nullptr;
  std::uint64_t bytes_ = 0, id_ = 0;
  std::string name_;
  VkBuffer buffer_ = VK_NULL_HANDLE;
  VkDeviceMemory memory_ = VK_NULL_HANDLE;
  VkBufferView view_ = VK_NULL_HANDLE;
  std::uint64_t address_ = 0;
  std::byte* mapped_ = nullptr;  // where device memory is host memory (CPU devices, shared memory)
};

/// An array of T on the device; dies with its owner, which waits for all passes.
template <class T>
class Buffer : public RawBuffer {
  static_assert(std::is_trivially_copyable_v<T>, "the device sees bytes, not objects");

 public:
  Buffer(Context& gpu, std::size_t count, Access access, std::string name)
      : RawBuffer(gpu, std::uint64_t(count) * sizeof(T), access, std::move(name)), count_(count) {}
  std::size_t size() const { return count_; }
  void upload(std::span<const T> data, std::size_t first = 0) {
    RawBuffer::upload(first * sizeof(T), data.data(), data.size_bytes());
  }
  void download(std::span<T> data, std::size_t first = 0) const {
    RawBuffer::download(first * sizeof(T), data.data(), data.size_bytes());
  }
  /// Elements [from, from + count) of another buffer, to `to` on.
  void copy_from(const Buffer& other, std::size_t from, std::size_t to, std::size_t count) {
    RawBuffer::copy_from(other, from * sizeof(T), to * sizeof(T), count * sizeof(T));
  }

 private:
  std::size_t count_ = 0;
};

}  // namespace ballot
