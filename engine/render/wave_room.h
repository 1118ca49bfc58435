// How many paths a wave holds.
#pragma once

#include <algorithm>
#include <cstdint>

namespace ballot {

/// What bounds a wave.
struct WaveRoom {
  bool cpu = false;
  std::uint64_t memory = 0;        // of the device, bytes
  std::uint64_t path_bytes = 1;    // of all buffers, for each path
  std::uint64_t put_off = 0;       // rays that a path may put off
  std::uint64_t most_records = 0;  // rays that one buffer may hold
  std::uint64_t most_rays = 0;     // that one dispatch takes
};

/// Paths under way at once, of so many in all. Waves of further hits hold ever fewer rays, and small ones leave a GPU idle, so there
/// waves are large: a buffer of an eighth of its memory, but not so large that getting memory takes longer than is gained.
/// Times as fast on an H200 (tools/measured/pictures.md): 2^24 paths instead of 2^22 1.04 to 1.18.
inline std::uint32_t wave_capacity(const WaveRoom& room, std::uint64_t paths) {
  constexpr std::uint64_t kBytesForEachOfAll = 8, kShareOfMemory = 8, kMost = 1 << 24, kMultiple = 64;
  const std::uint64_t each = std::max<std::uint64_t>(1, room.put_off);
  const std::uint64_t few =
      std::min<std::uint64_t>(room.cpu ? 1 << 18 : 1 << 22, room.put_off ? (1 << 23) / each : ~0u);
  const std::uint64_t bytes = std::min(kBytesForEachOfAll * paths, room.memory / kShareOfMemory);
  const std::uint64_t many = room.cpu ? few : std::clamp(bytes / room.path_bytes, few, std::max(few, kMost));
  const std::uint64_t most = std::min({many, room.most_records / each, room.most_rays});
  return std::uint32_t(std::max(kMultiple, most / kMultiple * kMultiple));
}

}  // namespace ballot
