#include "engine/core/key_sort.h"

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

}  // namespace ballot
