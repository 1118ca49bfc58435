// Devices, arrays on them, and jobs. ballot.h includes it.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "ballot_views.h"

namespace ballot {
inline namespace v1 {

/// Returns the Vulkan devices of this machine, usable or not. Throws Error(BALLOT_ERROR_DEVICE) if there is no driver.
inline std::vector<DeviceInfo> devices() {
  std::size_t count = 0;
  check(ballot_devices(nullptr, 0, &count));
  std::vector<DeviceInfo> list(count);
  check(ballot_devices(list.data(), list.size(), &count));
  return list;
}

/// A device that is open.
class Device {
 public:
  /// `name`: an index, part of a name, "gpu" or "cpu"; empty: the best GPU, else a CPU device. `validate` turns on
  /// Vulkan validation, for tests. Throws Error(BALLOT_ERROR_DEVICE), which says what each device lacks, if none is
  /// usable.
  explicit Device(const std::string& name = {}, bool validate = false) {
    const BallotDeviceOptions options{.name = name.c_str(), .validate = validate};
    BallotDevice* device = nullptr;
    check(ballot_device_open(&options, &device));
    handle_ = Owner(device);
  }
  /// A program's device: BallotVulkan. Throws Error(BALLOT_ERROR_DEVICE) if it lacks what Ballot needs.
  explicit Device(const BallotVulkan& vulkan) {
    const BallotDeviceOptions options{.vulkan = &vulkan};
    BallotDevice* device = nullptr;
    check(ballot_device_open(&options, &device));
    handle_ = Owner(device);
  }
  /// Returns what the device is.
  DeviceInfo info() const {
    DeviceInfo info;
    check(ballot_device_info(handle_.get(), &info));
    return info;
  }
  /// Returns the handle of the C interface, which stays this object's.
  BallotDevice* handle() const { return handle_.get(); }

 private:
  using Owner = detail::Handle<BallotDevice, ballot_device_close>;
  Owner handle_;
};

/// A trace in the background. The destructor waits for it. Rays and results must stay where they are until then.
class Job {
 public:
  /// Takes a job of the C interface, which is then this object's.
  explicit Job(BallotJob* job) : handle_(job) {}
  /// Waits for the end. Throws the Error that the trace would have thrown.
  Times wait() {
    Times times;
    check(ballot_job_wait(handle_.get(), &times));
    return times;
  }
  /// Returns true if the trace has ended; wait() then returns at once.
  bool poll() const { return ballot_job_poll(handle_.get()) != BALLOT_NOT_READY; }

 private:
  detail::Handle<BallotJob, ballot_job_destroy> handle_;
};

/// An array on a device: of Ray, Hit, Point, NearestPoint, Vertex or Matrix, or of numbers, as columns of answers have
/// them: float, std::array<float, 2>, 3 or 4, std::uint32_t, std::uint8_t or double.
template <class T>
class Array {
 public:
  /// `exported`: CUDA and others can use the memory. Throws Error(BALLOT_ERROR_WORK) if the device has no room or
  /// cannot export.
  Array(const Device& device, std::size_t count, bool exported = false) : count_(count) {
    const BallotBufferOptions options{.exported = exported};
    BallotBuffer* buffer = nullptr;
    check(ballot_buffer_create(device.handle(), detail::RecordOf<T>::value, count, &options, &buffer));
    handle_ = Owner(buffer);
  }
  /// Returns the number of records.
  std::size_t size() const { return count_; }
  /// Copies records from the host, beginning with number `first`.
  void write(std::span<const T> records, std::size_t first = 0) {
    check(ballot_buffer_write(handle_.get(), first, records.data(), records.size()));
  }
  /// Copies records to the host, beginning with number `first`.
  void read(std::span<T> records, std::size_t first = 0) const {
    check(ballot_buffer_read(handle_.get(), first, records.data(), records.size()));
  }
  /// Copies `count` records from CUDA's memory on the same GPU, where they lie side by side; the array is exported.
  void write_cuda(std::uint64_t address, std::size_t count, std::size_t first = 0) {
    check(ballot_buffer_write_cuda(handle_.get(), first, address, count));
  }
  /// Returns the address in CUDA's primary context of the same GPU, valid as long as this array. Calls of Ballot wait
  /// for the device before they return; wait for your own stream before a call that uses the array.
  std::uint64_t cuda_address() const {
    std::uint64_t address = 0;
    int device = 0;
    check(ballot_buffer_cuda(handle_.get(), &address, &device));
    return address;
  }
  /// Returns a new file descriptor of the memory, which the caller owns, and its size in bytes.
  std::pair<int, std::uint64_t> fd() const {
    std::pair<int, std::uint64_t> result{-1, 0};
    check(ballot_buffer_fd(handle_.get(), &result.first, &result.second));
    return result;
  }
  /// Returns the handle of the C interface, which stays this object's.
  BallotBuffer* handle() const { return handle_.get(); }

 private:
  using Owner = detail::Handle<BallotBuffer, ballot_buffer_destroy>;
  std::size_t count_;
  Owner handle_;
};

/// Returns a mesh over arrays on the device, which checks it there: of vertices, and three indices for each triangle;
/// without them vertices 0 1 2, 3 4 5, ... are triangles. Arrays may go once a scene has been made of it.
inline Mesh mesh(const Array<Vertex>& vertices) {
  Mesh m{.vertex_count = vertices.size()};
  m.vertex_buffer = vertices.handle();
  return m;
}
/// The same with indices.
inline Mesh mesh(const Array<Vertex>& vertices, const Array<std::uint32_t>& indices) {
  Mesh m = mesh(vertices);
  m.index_buffer = indices.handle(), m.index_count = indices.size();
  return m;
}

/// Returns an attribute over an array on the device: of float, or of std::array<float, 2>, 3 or 4.
template <class T>
Attribute attribute(const char* name, const Array<T>& values, BallotValuesOf of = BALLOT_OF_VERTICES) {
  static_assert(sizeof(T) <= 4 * sizeof(float), "a value has 1 to 4 numbers");
  Attribute a{.name = name, .of = of, .components = sizeof(T) / sizeof(float)};
  a.count = values.size(), a.buffer = values.handle();
  return a;
}

}  // namespace v1
}  // namespace ballot
