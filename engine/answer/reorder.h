// Ray reordering: rays are sorted by where they start and where they go, traced in that order, and their hits put back.
#pragma once

#include <memory>
#include <optional>

#include "engine/answer/dispatch.h"
#include "engine/core/geometry.h"
#include "engine/tree/device/radix_sort.h"
#include "shaders/shared/reorder.h"

namespace ballot {

/// Throws Error(Arguments) if a device cannot sort rays: it lacks subgroup shuffle, or its subgroups have more than 64
/// invocations.
void check_can_reorder(const DeviceInfo& device);
bool can_reorder(const DeviceInfo& device);

/// Returns the sources of the kernels of shaders/reorder.
std::vector<KernelSource> reorder_sources();

/// Rays to reorder: [begin, end) of a buffer, or as many from its first on as indirect arguments say, `end` at most.
struct GivenRays {
  const Buffer<Ray>& rays;
  RayRange range;
  const IndirectRays* indirect = nullptr;
};

/// Reorders one batch of rays at a time. A ray takes 64 bytes on the device, for 2^22 rays at most. On a device that is
/// the CPU the host sorts and copies, which takes a seventh of the time that kernels take there.
///
/// Source: Daniel Meister, Jakub Boksansky, Michael Guthe, Jiri Bittner. On Ray Reordering Techniques for Faster GPU
/// Ray Tracing. I3D 2020. Differs: hits go back to the places of their rays, so that callers see no order.
///
/// Belongs to the thread of its Context.
class Reorder {
 public:
  /// `on_host`: the host sorts and copies, as it does on CPU devices.
  Reorder(Context& gpu, bool on_host) : gpu_(gpu), on_host_(on_host) {}

  static constexpr std::uint32_t kMost = 1u << 22;  // rays of a batch; bounds its memory

  /// Records the passes that sort rays. rays() are valid for kernels recorded from now on. `done` is given the
  /// milliseconds of each pass. The host waits for the device before it sorts, and takes no indirect arguments. Throws
  /// Error(Work) if the device has no room.
  void sort(const GivenRays& given, const Bounds& scene, const Context::Done& done);
  /// The rays in their order, and the buffer for their hits.
  const Buffer<Ray>& rays() const { return *rays_; }
  Buffer<Hit>& hits() { return *hits_; }
  /// The buffer for their records of counters; made on first use.
  Buffer<RayStats>& stats();

  /// Records the pass that copies hits() to the places of the rays of the last sort() and, if `stats` is given, stats()
  /// too. The host waits for the device before it copies.
  void put_back(Buffer<Hit>& hits, const Context::Done& done, Buffer<RayStats>* stats = nullptr);

 private:
  /// The kernels for rays that the host counts, and for those of indirect arguments.
  struct Kernels {
    Kernels(Context& gpu, std::uint32_t most, bool indirect);
    std::uint32_t most;
    RadixSort sort;
    Kernel keys, gather, scatter;
    std::unique_ptr<Kernel> scatter_counters = {};
  };
  void make_room(std::uint32_t most);
  void make_kernels(bool indirect);
  void sort_on_host(const GivenRays& given, const Bounds& scene, const Context::Done& done);
  void put_back_on_host(Buffer<Hit>& hits, const Context::Done& done, Buffer<RayStats>* stats);
  void pass(Kernel& kernel, const Context::Done& done);

  Context& gpu_;
  const bool on_host_;
  std::uint32_t most_ = 0;  // rays that the buffers have room for
  std::optional<Buffer<std::uint32_t>> keys_[2], order_[2];
  std::optional<Buffer<Ray>> rays_;
  std::optional<Buffer<Hit>> hits_;
  std::optional<Buffer<RayStats>> stats_;
  std::unique_ptr<Kernels> direct_, indirect_;
  Kernels* used_ = nullptr;  // by the last sort()
  std::size_t sorted_ = 0;   // the buffer of order_ that holds its result
  ReorderPush push_{};
  std::vector<std::uint32_t> host_order_;  // where the host sorts
};

}  // namespace ballot
