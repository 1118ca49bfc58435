// Typed, owned device buffers.
#pragma once

#include <cstring>
#include <span>
#include <type_traits>
#include <utility>

#include "engine/gpu/context.h"

namespace ballot {

/// The ways in which the device uses a buffer. Values may be combined. They decide the usage flags of the buffer and
/// its limits. On a CPU device a storage buffer is a texel buffer too, unless it is too large for one. Indirect: holds
/// indirect arguments. Host: lies in the host's memory, for what the host reads or writes. Exported: other interfaces
/// can use its memory (export_fd()). Parts: kernels have parts of it bound (BufferPart), which alone keep the device's
/// limit. Uniform: holds a block of numbers that all invocations read.
enum class Access : std::uint32_t {
  Storage = 1,
  Texel = 2,
  Address = 4,
  Indirect = 8,
  Host = 16,
  Exported = 32,
  Parts = 64,
  Uniform = 128
};
constexpr Access operator|(Access a, Access b) { return Access(std::uint32_t(a) | std::uint32_t(b)); }
constexpr bool has(Access set, Access one) { return (std::uint32_t(set) & std::uint32_t(one)) != 0; }

/// An untyped device buffer, with a texel view (R32G32B32A32_UINT) and a device address where `access` asks for them.
/// Use Buffer<T>.
class RawBuffer {
 public:
  /// Allocates at least 16 bytes, so that an empty buffer can be bound. Throws Error(Work) that names the buffer, its
  /// size and the limit that it exceeds: maxStorageBufferRange, maxTexelBufferElements, maxMemoryAllocationSize,
  /// maxBufferSize or the heap.
  RawBuffer(Context& gpu, std::uint64_t bytes, Access access, std::string name);
  /// A buffer over memory of the host, which must outlive it. The device reads and writes it in place. Throws
  /// Error(Work) if the device cannot (can_import()) or the driver refuses.
  RawBuffer(Context& gpu, std::span<std::byte> host, std::string name);
  /// Returns true if the device can use this memory of the host in place: DeviceInfo::host_page.
  static bool can_import(const Context& gpu, const void* host);
  ~RawBuffer();
  RawBuffer(RawBuffer&& other) noexcept { *this = std::move(other); }
  RawBuffer& operator=(RawBuffer&& other) noexcept;

  /// Copy bytes to and from the host. Both wait for all passes (context.h). Throw Error(Work) if the bytes do not fit.
  void upload(std::uint64_t offset, const void* data, std::uint64_t bytes);
  void download(std::uint64_t offset, void* data, std::uint64_t bytes) const;
  /// Copies bytes that the host has now, as a pass behind those that are recorded. Waits, as upload() does, only where
  /// the host sees the memory, and for more than 65536 bytes or parts of words.
  void record_upload(std::uint64_t offset, const void* data, std::uint64_t bytes);
  /// A part of a buffer that is copied to a place in another.
  struct Part {
    std::uint64_t from, to, bytes;
  };
  /// Copies parts of another buffer on the device, all in one pass. Throws Error(Work) if they do not fit.
  void copy_parts(const RawBuffer& other, std::span<const Part> parts);
  /// Copies bytes from another buffer on the device. Throws Error(Work) if the bytes do not fit.
  void copy_from(const RawBuffer& other, std::uint64_t other_offset, std::uint64_t offset, std::uint64_t bytes);

  /// Returns a new file descriptor of the memory of a buffer with Access::Exported; the caller owns it. Throws
  /// Error(Work) if the driver gives none, Error(Arguments) if the buffer was made without that access.
  int export_fd() const;
  /// Returns the bytes of the memory behind the buffer, which begins at its start.
  std::uint64_t allocated_bytes() const { return allocated_; }

  /// Returns the context that the buffer was made in; null if it was moved to another RawBuffer.
  const Context* context() const { return gpu_; }
  /// Returns the access that the buffer was made with; of memory of the host: Storage.
  Access access() const { return access_; }
  std::uint64_t bytes() const { return bytes_; }
  const std::string& name() const { return name_; }
  VkBuffer handle() const { return buffer_; }
  std::uint64_t offset() const { return offset_; }  // of the bytes within handle(); 0 but over memory of the host
  VkBufferView view() const { return view_; }
  std::uint64_t address() const { return address_; }
  /// A number that no other buffer of the context ever has.
  std::uint64_t id() const { return id_; }
  /// The bytes as the passes that have ended left them; null unless the buffer lies in memory that the host sees.
  const std::byte* mapped() const { return mapped_; }
  std::byte* mapped() { return mapped_; }

 private:
  void allocate(Access access);
  void import(std::span<std::byte> host);
  void make_view(std::uint64_t bytes);
  void destroy();
  void copy(std::uint64_t offset, void* to, const void* from, std::uint64_t bytes) const;
  void check_fits(std::uint64_t offset, std::uint64_t bytes) const;

  Context* gpu_ = nullptr;
  std::uint64_t bytes_ = 0, offset_ = 0, id_ = 0, allocated_ = 0;
  Access access_ = Access::Storage;
  std::string name_;
  VkBuffer buffer_ = VK_NULL_HANDLE;
  VkDeviceMemory memory_ = VK_NULL_HANDLE;
  VkBufferView view_ = VK_NULL_HANDLE;
  std::uint64_t address_ = 0;
  std::byte* mapped_ = nullptr;  // null unless the host sees the memory (CPU devices, shared memory)
};

/// A part of a buffer, as a kernel has it bound. A whole buffer is one too. Its offset is a multiple of
/// DeviceInfo::buffer_alignment. Keeps a reference to the buffer.
struct BufferPart {
  BufferPart(const RawBuffer& whole) : buffer(whole), bytes(whole.bytes()) {}
  BufferPart(const RawBuffer& of, std::uint64_t first, std::uint64_t size) : buffer(of), offset(first), bytes(size) {}

  const RawBuffer& buffer;
  std::uint64_t offset = 0, bytes;
};

/// An array of T on the device. Its destructor waits for all passes.
template <class T>
class Buffer : public RawBuffer {
  static_assert(std::is_trivially_copyable_v<T>, "the device sees bytes, not objects");

 public:
  Buffer(Context& gpu, std::size_t count, Access access, std::string name)
      : RawBuffer(gpu, std::uint64_t(count) * sizeof(T), access, std::move(name)), count_(count) {}
  Buffer(Context& gpu, std::span<T> host, std::string name)
      : RawBuffer(gpu, std::as_writable_bytes(host), std::move(name)), count_(host.size()) {}
  /// Takes a buffer that held something else.
  explicit Buffer(RawBuffer&& other) : RawBuffer(std::move(other)), count_(std::size_t(bytes() / sizeof(T))) {}
  std::size_t size() const { return count_; }
  void upload(std::span<const T> data, std::size_t first = 0) {
    RawBuffer::upload(first * sizeof(T), data.data(), data.size_bytes());
  }
  void record_upload(std::span<const T> data, std::size_t first = 0) {
    RawBuffer::record_upload(first * sizeof(T), data.data(), data.size_bytes());
  }
  void download(std::span<T> data, std::size_t first = 0) const {
    RawBuffer::download(first * sizeof(T), data.data(), data.size_bytes());
  }
  /// Copies elements [from, from + count) of another buffer to [to, to + count) of this one.
  void copy_from(const Buffer& other, std::size_t from, std::size_t to, std::size_t count) {
    RawBuffer::copy_from(other, from * sizeof(T), to * sizeof(T), count * sizeof(T));
  }

 private:
  std::size_t count_ = 0;
};

}  // namespace ballot
