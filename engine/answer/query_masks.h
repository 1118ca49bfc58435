// Masks of the questions of a kernel and of the triangles that it may find. Internal to engine/answer.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/answer/query_kernel.h"

namespace ballot {

/// Holds the masks that kernels with BALLOT_MASKS read (shaders/lib/query/masks.glsl). Belongs to the thread of its
/// Context.
class QueryMasks {
 public:
  explicit QueryMasks(Context& gpu) : gpu_(gpu) {}

  /// Takes a word for each triangle of a tree; none: all bits. Throws Error(Arguments) if there are not as many as
  /// triangles.
  void take(DeviceTree& tree, std::span<const std::uint32_t> triangle_masks);
  void bind_triangles(QueryKernel& kernel) { kernel.bind(BIND_TRIANGLE_MASKS, *triangle_masks_); }
  /// Binds the masks of the questions that a kernel is asked next; none: all bits. `apart`: those of a stream under way
  /// stay as they are.
  void bind(QueryKernel& kernel, std::size_t questions, std::span<const std::uint32_t> masks, bool apart);
  /// The same for `count` questions from number `first` on, whose masks are on the device; null: all bits.
  void bind_there(QueryKernel& kernel, const Buffer<std::uint32_t>* masks, std::uint64_t first, std::size_t count);
  /// Binds those that were bound last.
  void bind_again(QueryKernel& kernel) { kernel.bind(BIND_RAY_MASKS, *last_); }

 private:
  /// The masks of a chunk.
  struct Room {
    std::unique_ptr<Buffer<std::uint32_t>> there, here;
  };

  Context& gpu_;
  std::unique_ptr<Buffer<std::uint32_t>> triangle_masks_, apart_, no_masks_;
  std::array<Room, 3> rooms_;  // of chunks under way, taken in turn
  std::size_t turn_ = 0;
  std::optional<BufferPart> last_;
  std::vector<std::uint32_t> all_bits_, uploaded_;
};

}  // namespace ballot
