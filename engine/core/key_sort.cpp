#include "engine/core/key_sort.h"

#include <algorithm>
#include <array>

namespace ballot {

namespace {

constexpr int kDigitBits = 12;
constexpr std::size_t kDigits = 1 << kDigitBits;
using Counts = std::array<std::uint32_t, kDigits>;

}  // namespace

void sort_keys(std::vector<PlacedKey>& keys, std::vector<PlacedKey>& room, int bits) {
  const std::size_t count = keys.size();
  if (count < 2) return;
  // One chunk a core. Small ones would take longer to count than to move.
  const std::size_t cores = std::min(core_count(), std::max<std::size_t>(1, count / (4 * kDigits)));
  const std::size_t chunk = (count + cores - 1) / cores;
  std::vector<Counts> counts(cores);
  for (int shift = 0; shift < bits; shift += kDigitBits) {
    const auto digit_of = [&](const PlacedKey& k) { return k.key >> shift & (kDigits - 1); };
    for_chunks(count, chunk, [&](std::size_t begin, std::size_t end) {
      Counts& own = counts[begin / chunk];
      own.fill(0);
      for (std::size_t i = begin; i < end; ++i) ++own[digit_of(keys[i])];
    });
    std::uint32_t sum = 0;  // now each count becomes the place of its first key
    const std::size_t chunks = (count + chunk - 1) / chunk;
    for (std::size_t d = 0; d < kDigits; ++d)
      for (std::size_t c = 0; c < chunks; ++c) sum += std::exchange(counts[c][d], sum);
    for_chunks(count, chunk, [&](std::size_t begin, std::size_t end) {
      Counts& own = counts[begin / chunk];
      for (std::size_t i = begin; i < end; ++i) room[own[digit_of(keys[i])]++] = keys[i];
    });
    keys.swap(room);
  }
}

void order_by_counting(std::span<const std::uint32_t> keys, int bits, std::vector<std::uint32_t>& order) {
  const std::size_t count = keys.size(), values = std::size_t{1} << bits;
  order.resize(count);
  if (count == 0) return;
  // One chunk a core. Small ones would take longer to count than to move.
  const std::size_t chunks = std::clamp<std::size_t>(count / values, 1, core_count());
  const std::size_t chunk = (count + chunks - 1) / chunks;
  std::vector<std::vector<std::uint32_t>> counts(chunks, std::vector<std::uint32_t>(values));
  for_chunks(count, chunk, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint32_t>& own = counts[begin / chunk];
    for (std::size_t i = begin; i < end; ++i) ++own[keys[i]];
  });
  std::uint32_t sum = 0;  // now each count becomes the place of its first key
  for (std::size_t v = 0; v < values; ++v)
    for (std::vector<std::uint32_t>& own : counts) sum += std::exchange(own[v], sum);
  for_chunks(count, chunk, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint32_t>& own = counts[begin / chunk];
    for (std::size_t i = begin; i < end; ++i) order[own[keys[i]]++] = std::uint32_t(i);
  });
}

}  // namespace ballot
