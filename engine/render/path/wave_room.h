// Chooses the number of paths that a wave holds.
#pragma once

#include <algorithm>
#include <cstdint>

namespace ballot {

/// The limits of a wave.
struct WaveRoom {
  bool cpu = false;                // the device is a CPU
  bool grows = false;              // the device is a GPU with memory of its own
  std::uint64_t memory = 0;        // bytes of the device
  std::uint64_t path_bytes = 1;    // bytes of all buffers per path
  std::uint64_t deferred = 0;      // most deferred rays of a path
  std::uint64_t most_records = 0;  // rays that one buffer may hold
  std::uint64_t most_rays = 0;     // rays that one dispatch may take
};

/// Returns the number of paths in flight at once, given the number of all paths of the picture. Later waves hold ever
/// fewer rays, and small waves leave a GPU idle. Waves on a GPU with memory of its own are therefore large: all buffers
/// together take up to an eighth of its memory, but at most 8 bytes for each path of the picture, because allocation
/// takes time too. On an H200 this is 1.03 to 1.43 times as fast (tools/measured/pictures.md).
inline std::uint32_t wave_capacity(const WaveRoom& room, std::uint64_t paths) {
  constexpr std::uint64_t kBytesForEachOfAll = 8, kShareOfMemory = 8, kMultiple = 64;
  constexpr std::uint64_t kMost = 1 << 24;  // sample_of_path() of shaders/lib/path/main.glsl counts paths in floats
  const std::uint64_t each = std::max<std::uint64_t>(1, room.deferred);
  const std::uint64_t few =
      std::min<std::uint64_t>(room.cpu ? 1 << 18 : 1 << 22, room.deferred ? (1 << 23) / each : ~0u);
  const std::uint64_t bytes = std::min(kBytesForEachOfAll * paths, room.memory / kShareOfMemory);
  const std::uint64_t many = !room.grows ? few : std::clamp(bytes / room.path_bytes, few, std::max(few, kMost));
  const std::uint64_t most = std::min({many, room.most_records / each, room.most_rays});
  return std::uint32_t(std::max(kMultiple, most / kMultiple * kMultiple));
}

}  // namespace ballot
