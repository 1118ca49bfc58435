// The order in which a GPU takes points: those of a subgroup near each other. Internal to engine/answer.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "engine/core/geometry.h"
#include "engine/gpu/kernel.h"
#include "engine/tree/device/radix_sort.h"
#include "shaders/shared/query.h"

namespace ballot {

/// Returns the sources of the kernel that finds such orders.
std::vector<KernelSource> neighbour_sources();

/// Finds an order of points on the device, and whether it pays to sort all of them (shaders/query/neighbours.comp). The
/// host sees nothing of it. A point takes 20 bytes, for 2^22 points at most. Belongs to the thread of its Context.
class PointOrder {
 public:
  explicit PointOrder(Context& gpu) : gpu_(gpu) {}

  /// Records the passes that find the order of points [first, first + count) of a buffer. `scene`: bounds of what is
  /// near. `done` is given the milliseconds of each pass. Throws Error(Work) if the device has no room.
  void record(const RawBuffer& points, std::uint32_t first, std::uint32_t count, const Bounds& scene,
              const Context::Done& done);
  /// Binds what a kernel with BALLOT_BLOCKS reads. Call it after record().
  template <class Kernel>
  void bind(Kernel& kernel) const {
    kernel.bind(BIND_NEIGHBOUR_STATE, *state_);
    kernel.bind(BIND_SORTED, *args_);
    kernel.bind(BIND_ORDER_NEAR, *near_);
    kernel.bind(BIND_ORDER_SORTED, *order_[sorted_]);
  }

 private:
  void make_room(std::uint32_t count);

  Context& gpu_;
  std::uint32_t most_ = 0;  // points that the buffers have room for
  std::optional<Buffer<NeighbourState>> state_;
  std::optional<Buffer<IndirectArgs>> args_;
  std::optional<Buffer<std::uint32_t>> near_, keys_[2], order_[2];
  std::unique_ptr<Kernel> kernel_;
  std::unique_ptr<RadixSort> sort_;  // none if the device cannot sort
  std::size_t sorted_ = 0;           // the buffer of order_ that holds the result
};

}  // namespace ballot
