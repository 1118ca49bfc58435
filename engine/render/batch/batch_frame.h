// How a batch's rays are made, for doing it again in every frame. Internal to engine/render/batch*.cpp.
#pragma once

#include "engine/render/batch/batch.h"

namespace ballot {

constexpr std::uint32_t kGeneratorGroup = 64;  // workgroup of shaders/rays/*.comp and shaders/shade/shade.comp

/// A dispatch of a generator: what it makes of one chunk of primary hits for one chunk of the batch.
struct GeneratorRun {
  Kernel* kernel;
  std::size_t source;  // chunk of primary hits
  std::size_t target;  // chunk of the batch
  SecondaryPush push;
};

struct RayBatch::Frame {
  bool from_camera = false;  // the batch's rays are the primary ones; `primaries` and all from `starts` on are empty
  PrimaryPush camera{};
  Kernel* primary = nullptr;
  std::vector<Chunk> primaries;               // their hits are those that the batch's rays start at
  std::vector<Buffer<std::uint32_t>> listed;  // a chunk's pixels; empty where tiles fill the picture
  std::vector<std::uint32_t> start_count;     // by chunk of primaries
  std::vector<Buffer<Start>> starts;
  std::vector<GeneratorRun> runs;
  std::unique_ptr<Buffer<Hit>> scratch;  // what frames trace primary rays into
  Kernel* shade = nullptr;
  std::unique_ptr<Buffer<FilmPixel>> film;  // of the largest chunk
};

}  // namespace ballot
