// One view's picture, in steps: checkpoints, going on from one, errors to a reference over time.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tools/cli.h"

namespace ballot::cli {

/// How far the picture was from the reference after some time.
struct ErrorAt {
  std::uint32_t samples;
  double seconds;  // of rendering, without the comparisons
  ImageError error;
};

struct RenderJob {
  RenderOptions options;
  double checkpoint_s = 60;  // between checkpoints; 0: none
  bool resume = false;
  std::optional<Image> reference = {};
};

struct Rendered {
  Image image;
  RenderTimes times;
  std::uint32_t resumed_at = 0;  // samples that a checkpoint had
  std::vector<ErrorAt> errors;   // empty without a reference
  double seconds = 0;            // wall time, from the film's beginning to the picture
  double film_s = 0;             // of that: making the film, to and from the device, and making a picture of it
};

/// OUT.checkpoint.exr beside OUT.exr.
std::filesystem::path checkpoint_of(const std::filesystem::path& exr);

/// Renders a view whose picture will be `exr`. With resume and a checkpoint there goes on from it. The checkpoint of this run stays until
/// finish_job() is called, so that nothing is lost if the picture cannot be written. Throws as Engine::render and read_film do.
Rendered render_job(Engine& engine, const View& view, const RenderJob& job, const std::filesystem::path& exr);

/// The picture is written: its checkpoint goes.
void finish_job(const std::filesystem::path& exr);

/// A table of errors over time, JSON beside the picture, and a plot of it if matplotlib is there.
void report_errors(const Rendered& rendered, const std::filesystem::path& exr);

}  // namespace ballot::cli
