// What the passes of waves work on. Internal to engine/render/wave*.cpp.
#pragma once

#include <deque>
#include <optional>

#include "engine/render/path/waves.h"

namespace ballot {

/// Rays with what they carry, and room for their hits.
struct Waves::Wave {
  Buffer<Ray> rays;
  Buffer<Hit> hits;
  std::unique_ptr<Buffer<Carried>> carried;  // where paths go on: those that begin all carry the same

  Wave(Context& gpu, std::uint32_t size)
      : rays(gpu, size, Access::Storage, "wave rays"), hits(gpu, size, Access::Storage, "wave hits") {}
  std::uint64_t bytes() const { return rays.bytes() + hits.bytes() + (carried ? carried->bytes() : 0); }
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

/// What a wave's rays are traced by.
struct Waves::Asked {
  Query query = {};
  std::string pass = {};                   // its name among times
  std::optional<std::uint32_t> seen = {};  // how many such rays there were when the host looked
  std::uint32_t turns = 0;                 // that rays took through what is transparent, at most, where the host looked
};

/// A count that the host knows once a submission has ended.
struct Waves::Awaiting {
  Count count;
  std::uint64_t submission;
};

/// The same for all waves of one call, and how far the batch of paths at hand has come.
struct Waves::Batch {
  const WaveSettings& settings;
  WavePlan plan;
  const Buffer<std::uint32_t>& listed;
  Buffer<FilmPixel>& film;
  PassTimes* times;
  Kernel *scatter = nullptr, *connect = nullptr, *alpha = nullptr;  // null where there is nothing to do
  bool makes_rays = false;                                          // the eye's rays need not be read
  Asked primary = {}, next = {};
  Asked shadow = {}, next_shadow = {};  // from hits of either
  WavePush push = {};
  std::uint32_t together = 0;    // depths since the last submission
  std::uint64_t submission = 0;  // of this batch, the last but the one that is recorded; 0: none yet
  std::uint32_t expected = 0;    // depths after which batches before this one had no rays left; 0: nothing is known
  std::uint32_t heard = 0;       // depths of which the host has heard
  std::uint32_t ended_at = 0;    // the depths after which this one had none; 0: not known yet
  bool guesses = false;          // as many turns through what is transparent as before are recorded, and no more
  bool guessed_wrong = false;
  Asked& shadow_at_hand() { return push.depth == 0 ? shadow : next_shadow; }
  std::deque<Awaiting> lefts = {}, leftovers = {};  // of depths; of turns
};

}  // namespace ballot
