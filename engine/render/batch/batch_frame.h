// The passes that make a batch's rays, kept so that every frame can run them again. Internal to engine/render/batch.
#pragma once

#include "engine/render/batch/batch.h"
#include "engine/render/data/run_pass.h"

namespace ballot {

/// One dispatch of a ray generator: it reads one chunk of primary hits and writes rays of one chunk of the batch.
struct GeneratorRun {
  Kernel* kernel;
  std::size_t source;  // index of the chunk of primary hits
  std::size_t target;  // index of the chunk of the batch
  SecondaryPush push;
};

/// The kernels and buffers of a frame.
struct RayBatch::Frame {
  /// The batch's rays are the primary rays. `primaries`, `start_count`, `starts`, `runs` and `scratch` are then empty.
  bool from_camera = false;
  PrimaryPush camera{};
  Kernel* primary = nullptr;
  std::vector<Chunk> primaries;               // primary rays, and the hits at which the batch's rays start
  std::vector<Buffer<std::uint32_t>> listed;  // pixels of each chunk; empty if whole tiles fill the picture
  std::vector<std::uint32_t> start_count;     // number of hits in each chunk of `primaries`
  std::vector<Buffer<Start>> starts;          // those hits
  std::vector<GeneratorRun> runs;
  std::unique_ptr<Buffer<Hit>> scratch;  // hits of the primary rays that a frame traces
  Kernel* shade = nullptr;
  std::unique_ptr<Buffer<FilmPixel>> film;  // large enough for the largest chunk
};

}  // namespace ballot
