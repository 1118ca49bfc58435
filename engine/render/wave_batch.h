// What the passes of waves work on. Internal to engine/render/wave*.cpp.
#pragma once

#include "engine/render/waves.h"

namespace ballot {

constexpr std::uint32_t kWaveGroup = 64;  // workgroup of shaders/path/*.comp

/// Rays with what they carry, and room for their hits.
struct Waves::Wave {
  Buffer<Ray> rays;
  Buffer<Hit> hits;
  Buffer<Carried> carried;

  Wave(Context& gpu, std::uint32_t size)
      : rays(gpu, size, Access::Storage, "wave rays"),
        hits(gpu, size, Access::Storage, "wave hits"),
        carried(gpu, size, Access::Storage, "carried") {}
  std::uint64_t bytes() const { return rays.bytes() + hits.bytes() + carried.bytes(); }
};

/// Rays that went on, in two turns; only for scenes with alpha.
struct Waves::Alpha {
  struct Side {
    Buffer<Ray> rays;
    Buffer<Hit> hits;
    Buffer<std::uint32_t> ids;
    Side(Context& gpu, std::uint32_t size)
        : rays(gpu, size, Access::Storage, "rays that went on"),
          hits(gpu, size, Access::Storage, "hits of rays that went on"),
          ids(gpu, size, Access::Storage, "numbers of rays that went on") {}
  };
  std::uint32_t room;
  Side sides[2];
  Alpha(Context& gpu, std::uint32_t size) : room(size), sides{{gpu, size}, {gpu, size}} {}
  std::uint64_t bytes() const {
    std::uint64_t sum = 0;
    for (const Side& s : sides) sum += s.rays.bytes() + s.hits.bytes() + s.ids.bytes();
    return sum;
  }
};

/// The same for all waves of one call, and how far the batch at hand has come.
struct Waves::Batch {
  const WaveSettings& settings;
  WavePlan plan;
  Buffer<FilmPixel>& film;
  PassTimes& times;
  Kernel *scatter = nullptr, *connect = nullptr;  // null where there is nothing to connect
  Query primary = {}, next = {}, shadow = {};
  WavePush push = {};
  std::uint32_t together = 0;    // depths since the last submission
  std::uint64_t submission = 0;  // of this batch, the last but the one that is recorded; 0: none yet
  Count left = {};               // what it left to the next wave
};

}  // namespace ballot
