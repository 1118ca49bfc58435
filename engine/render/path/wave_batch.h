// The buffers and the state that the passes of waves work on. Internal to engine/render/path.
#pragma once

#include <deque>
#include <optional>

#include "engine/render/path/waves.h"

namespace ballot {

/// The rays of a wave, the state that each carries, and room for their hits.
struct Waves::Wave {
  Buffer<Ray> rays;
  Buffer<Hit> hits;
  std::unique_ptr<Buffer<Carried>> carried;  // only if the plan has secondary rays: all camera rays carry the same

  Wave(Context& gpu, std::uint32_t size)
      : rays(gpu, size, Access::Storage, "wave rays"), hits(gpu, size, Access::Storage, "wave hits") {}
  std::uint64_t bytes() const { return rays.bytes() + hits.bytes() + (carried ? carried->bytes() : 0); }
};

/// The rays that pass through a hit, in two buffers that take turns. Only for scenes with alpha.
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

/// A query for the rays of a wave, and what the host has learned of such rays.
struct Waves::Asked {
  Query query = {};
  std::string pass = {};                   // name of the pass in PassTimes
  std::optional<std::uint32_t> seen = {};  // number of such rays when the host last read it
  std::uint32_t turns = 0;                 // most turns through transparent surfaces that the host has seen
};

/// A count that the host can read once a submission has ended.
struct Waves::Awaiting {
  Count count;
  std::uint64_t submission;
};

/// The state of the current batch of paths, and what all batches of one call share.
struct Waves::Batch {
  const WaveSettings& settings;
  WavePlan plan;
  const Buffer<std::uint32_t>& listed;
  Buffer<FilmPixel>& film;
  PassTimes* times;
  Kernel *scatter = nullptr, *connect = nullptr, *alpha = nullptr;  // null if the plan does not need it
  bool makes_rays = false;                                          // the kernels may make the camera rays
  Asked primary = {}, next = {};
  Asked shadow = {}, next_shadow = {};  // shadow rays from primary hits; from later hits
  WavePush push = {};
  std::uint32_t together = 0;    // depths recorded since the last submission
  std::uint64_t submission = 0;  // the last submission of this batch that was flushed; 0: none yet
  std::uint32_t expected = 0;    // number of depths after which earlier batches had no rays left; 0: unknown
  std::uint32_t heard = 0;       // number of depths whose counts the host has read
  std::uint32_t ended_at = 0;    // number of depths after which this batch had no rays left; 0: not known yet
  bool guesses = false;          // records as many turns through transparent surfaces as before, and no more
  bool guessed_wrong = false;    // rays were left after those turns: the batch must be run again
  Asked& shadow_at_hand() { return push.depth == 0 ? shadow : next_shadow; }
  std::deque<Awaiting> lefts = {}, leftovers = {};  // rays left after each depth; after the guessed turns
};

}  // namespace ballot
