// The memory of an exported buffer in CUDA's address space, through the CUDA driver's library, which is opened at run
// time.
#pragma once

#include <cstdint>

namespace ballot {
class RawBuffer;
}

namespace ballot::api {

/// An import of a buffer's memory into CUDA: into the primary context of the CUDA device that is the buffer's GPU.
class CudaMemory {
 public:
  /// `uuid` is that of the Vulkan device. Throws Error(Work) if a call of the CUDA driver fails, and names the call.
  /// Throws Error(Device) if there is no CUDA driver, or if none of its devices is this GPU.
  CudaMemory(const RawBuffer& buffer, const std::uint8_t* uuid);
  ~CudaMemory();
  CudaMemory(const CudaMemory&) = delete;
  CudaMemory& operator=(const CudaMemory&) = delete;

  std::uint64_t address() const { return address_; }
  /// Copies `bytes` from CUDA's memory on this GPU to `offset` of the buffer, on the device, and waits. Throws
  /// Error(Work) if CUDA cannot.
  void copy_from(std::uint64_t address, std::uint64_t offset, std::uint64_t bytes) const;
  int device() const { return device_; }

 private:
  std::uint64_t address_ = 0;
  int device_ = 0;
  void *context_ = nullptr, *memory_ = nullptr;
};

}  // namespace ballot::api
