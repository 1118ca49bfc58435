// A radix sort on the device.
#pragma once

#include <array>

#include "engine/tree/device/build_kernels.h"

namespace ballot {

/// The buffers of a sort: keys of key_words() words, lower word first, and the prim of each key. The second of each
/// pair is where the first pass writes.
struct SortBuffers {
  std::array<Buffer<std::uint32_t>*, 2> keys;
  std::array<Buffer<std::uint32_t>*, 2> prims;
};

/// The number of keys: `most`, or what indirect arguments on the device say if that is less.
struct KeyCount {
  std::uint32_t most;
  const Buffer<IndirectArgs>* args = nullptr;
  std::uint32_t index = 0;  // of the arguments
};

/// Sorts keys by a number of their lowest bits, and with each key its prim: at first its index. Keys with equal bits
/// keep their order. Belongs to the thread of its Context.
class RadixSort {
 public:
  /// Prepares for keys of up to `bits` bits: a multiple of 8 up to 64. Makes room for `most` keys. `indirect`: their
  /// number comes from indirect arguments. Throws Error(Work) if the device has no room.
  RadixSort(Context& gpu, std::uint32_t bits, std::uint32_t most, bool indirect = false);

  /// Records the passes that sort the first `count` keys of buffers.keys[0]. Returns the index of the buffers that then
  /// hold the result. buffers.prims[0] need not be filled. Nothing waits for the device. `done` is given the device
  /// milliseconds of each pass.
  std::size_t record(const SortBuffers& buffers, const KeyCount& count, const Context::Done& done);

 private:
  std::uint32_t tiles(std::uint32_t count) const;

  Context& gpu_;
  const std::uint32_t bits_;
  Buffer<std::uint32_t> counts_, totals_;
  Kernel histogram_, scan_, scatter_;
};

}  // namespace ballot
