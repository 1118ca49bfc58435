// What leaves triangles out of the answers to questions, by words of each question: the filters FILTER_... of
// shaders/shared/query.h.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "engine/answer/stream.h"
#include "engine/gpu/buffer.h"
#include "engine/tree/host/forest.h"
#include "shaders/shared/query.h"

namespace ballot {

/// Words of questions, of each filter that they have; of the others none.
struct FilterWords {
  std::array<std::vector<std::uint32_t>, FILTERS> of;

  /// Adds the words of question i among others.
  void add(const FilterWords& from, std::size_t i) {
    for (std::size_t f = 0; f < FILTERS; ++f)
      if (!from.of[f].empty()) of[f].push_back(from.of[f][i]);
  }
  /// Puts them into the order of questions; none: they stay.
  void arrange(const std::vector<std::uint32_t>& order) {
    for (std::vector<std::uint32_t>& words : of)
      if (!order.empty() && !words.empty()) Rearranged<std::uint32_t, std::uint32_t>().arrange(words, order);
  }
};

/// Writes the words of questions from number `first` on, by filters. Those that are empty leave out nothing.
struct FilterReaders {
  using Read = std::function<void(std::uint64_t first, std::span<std::uint32_t> room)>;
  std::array<Read, FILTERS> of = {};

  /// The filters that there are, as BALLOT_FILTERS.
  std::uint32_t bits() const {
    std::uint32_t bits = 0;
    for (std::uint32_t f = 0; f < FILTERS; ++f) bits |= std::uint32_t(bool(of[f])) << f;
    return bits;
  }
  FilterWords read(std::uint64_t first, std::size_t count) const {
    FilterWords words;
    for (std::size_t f = 0; f < FILTERS; ++f)
      if (of[f]) words.of[f].resize(count), of[f](first, words.of[f]);
    return words;
  }
};

/// Words of questions in arrays on the device, by filters. Null ones leave out nothing.
struct DeviceFilters {
  std::array<const Buffer<std::uint32_t>*, FILTERS> of = {};

  std::uint32_t bits() const { return readers().bits(); }
  /// The same for the host. Refers to the arrays.
  FilterReaders readers() const {
    FilterReaders readers;
    for (std::size_t f = 0; f < FILTERS; ++f)
      if (const Buffer<std::uint32_t>* words = of[f])
        readers.of[f] = [words](std::uint64_t first, std::span<std::uint32_t> room) {
          words->download(room, std::size_t(first));
        };
    return readers;
  }
};

/// Tells on the host what filters leave out. Thread-safe.
class FilterJudge {
 public:
  /// Keeps both. `forest`: null if all triangles are shared. `triangle_masks`: a word for each triangle; none: all
  /// bits.
  FilterJudge(const Forest* forest, std::span<const std::uint32_t> triangle_masks)
      : forest_(forest && forest->has_groups() ? forest : nullptr), triangle_masks_(triangle_masks) {}

  /// Returns false if the filters of question i leave the triangle out.
  bool keeps(const FilterWords& words, std::size_t i, std::uint32_t prim) const {
    const auto& [masks, excluded, groups] = words.of;
    const std::uint32_t mine = masks.empty() ? ~0u : masks[i];
    if (((triangle_masks_.empty() ? ~0u : triangle_masks_[prim]) & mine) == 0) return false;
    if (!excluded.empty() && excluded[i] == prim) return false;
    if (groups.empty() || !forest_) return true;
    const std::uint32_t group = forest_->group_of(forest_->place_of(prim).instance);
    return group == GROUP_SHARED || group == groups[i];
  }

 private:
  const Forest* forest_;
  std::span<const std::uint32_t> triangle_masks_;
};

}  // namespace ballot
