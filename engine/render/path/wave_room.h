// How many paths a wave holds.
#pragma once

#include <algorithm>
#include <cstdint>

namespace ballot {

/// What bounds a wave.
struct WaveRoom {
  bool cpu = false;
  bool grows = false;              // a GPU with memory of its own
  std::uint64_t memory = 0;        // of the device, bytes
  std::uint64_t path_bytes = 1;    // of all buffers, for each path
  std::uint64_t deferred = 0;      // rays that a path may put off
  std::uint64_t most_records = 0;  // rays that one buffer may hold
  std::uint64_t most_rays = 0;     // that one dispatch takes
};

/// Paths under way at once, of so many in all. Waves of further hits hold ever fewer rays, and small ones leave a GPU idle, so there
/// waves are large: all buffers together an eighth of its memory, but 8 bytes for each path in all, as getting memory takes
/// time too. Times as fast on an H200 (tools/measured/pictures.md): 1.03 to 1.43.
inline std::uint32_t wave_capacity(const WaveRoom& room, std::uint64_t paths) {
  constexpr std::uint64_t kBytesForEachOfAll = 8, kShareOfMemory = 8, kMultiple = 64;
  constexpr std::uint64_t kMost = 1 << 24;  // sample_of_path() of shaders/path/scatter.comp counts paths in floats
  const std::uint64_t each = std::max<std::uint64_t>(1, room.deferred);
  const std::uint64_t few =
      std::min<std::uint64_t>(room.cpu ? 1 << 18 : 1 << 22, room.deferred ? (1 << 23) / each : ~0u);
  const std::uint64_t bytes = std::min(kBytesForEachOfAll * paths, room.memory / kShareOfMemory);
  const std::uint64_t many = !room.grows ? few : std::clamp(bytes / room.path_bytes, few, std::max(few, kMost));
  const std::uint64_t most = std::min({many, room.most_records / each, room.most_rays});
  return std::uint32_t(std::max(kMultiple, most / kMultiple * kMultiple));
}

}  // namespace ballot
