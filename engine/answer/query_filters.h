// The words of questions that filters read, and what they compare them with in the scene. Internal to engine/answer.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "engine/answer/filters.h"
#include "engine/answer/query_kernel.h"

namespace ballot {

/// Holds what kernels with BALLOT_FILTERS read (shaders/lib/query/filters.glsl). Belongs to the thread of its Context.
class QueryFilters {
 public:
  explicit QueryFilters(Context& gpu) : gpu_(gpu) {}

  /// Takes what filters compare words with in a tree. `triangle_masks`: a word for each triangle; none: all bits.
  /// Returns the filters of kernels (BALLOT_FILTERS): those that may leave something out there. Throws Error(Arguments)
  /// if there are not as many masks as triangles.
  std::uint32_t take(DeviceTree& tree, std::uint32_t filters, std::span<const std::uint32_t> triangle_masks);
  /// Binds what was taken. This and what follows is for kernels of the filters that take() has returned.
  void bind_scene(QueryKernel& kernel);
  /// Binds the words of the questions that a kernel is asked next; masks that there are none of have all bits. `apart`:
  /// those of a stream under way stay as they are.
  void bind(QueryKernel& kernel, std::size_t questions, const FilterWords& words, bool apart);
  /// The same for `count` questions from number `first` on, whose words are on the device.
  void bind_there(QueryKernel& kernel, const DeviceFilters& words, std::uint64_t first, std::size_t count);
  /// Binds those that were bound last.
  void bind_again(QueryKernel& kernel);

 private:
  /// The words of a chunk.
  struct Room {
    std::unique_ptr<Buffer<std::uint32_t>> there, here;
  };
  /// The words of one filter.
  struct Words {
    std::unique_ptr<Buffer<std::uint32_t>> apart;
    std::array<Room, 3> rooms;  // of chunks under way, taken in turn
    std::size_t turn = 0;
    std::optional<BufferPart> last;
  };
  bool has(std::uint32_t filter) const { return filters_ >> filter & 1; }
  void take_masks(const DeviceTree& tree, std::span<const std::uint32_t> triangle_masks);
  void take_groups(const DeviceTree& tree);
  void bind_words(QueryKernel& kernel, std::uint32_t filter, std::span<const std::uint32_t> words, bool apart);

  Context& gpu_;
  std::uint32_t filters_ = 0;
  std::array<Words, FILTERS> words_;
  std::unique_ptr<Buffer<std::uint32_t>> triangle_masks_, no_masks_, groups_;
  std::uint64_t generation_ = 0;  // of the tree whose groups were taken
  std::vector<std::uint32_t> all_bits_, uploaded_;
};

}  // namespace ballot
