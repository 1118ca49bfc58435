// The rendering of one view in steps: it writes checkpoints, resumes from one, and compares the picture with a
// reference over time.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tools/program/cli.h"

namespace ballot::cli {

/// The picture's error against the reference at one point of the rendering.
struct ErrorAt {
  std::uint32_t samples;  // per pixel
  double seconds;         // of rendering, without the comparisons
  ImageError error;
};

struct RenderJob {
  RenderOptions options;
  double checkpoint_s = 60;  // seconds between checkpoints; 0: no checkpoints
  bool resume = false;
  std::string again = {};  // the command line that resumes, for the message of a signal
  std::string rows = {};   // which rows of the view these are, for messages; "": all
  std::optional<Image> reference = {};
};

struct Rendered {
  Image image;
  RenderTimes times;
  std::uint32_t resumed_at = 0;  // samples per pixel that the checkpoint held; 0: none was read
  std::size_t bands_there = 0;   // of a picture in bands: bands that an earlier run had finished
  std::vector<ErrorAt> errors;   // empty without a reference
  double seconds = 0;            // wall time from creating the film to the finished picture
  double film_s = 0;             // part of it: creating the film, copying it to and from the device, making the picture
};

/// Returns the path of a picture's checkpoint: OUT.checkpoint.exr beside OUT.exr.
std::filesystem::path checkpoint_of(const std::filesystem::path& exr);

/// Renders a view whose picture will be written to `exr`. If job.resume is set and a checkpoint exists, it continues
/// from the checkpoint. The checkpoint of this run stays until finish_job() is called, so that nothing is lost if the
/// picture cannot be written. A checkpoint that cannot be written gives a warning, and rendering goes on.
/// SIGINT, SIGTERM and SIGHUP end the rendering after the current step: a checkpoint is written and Stopped thrown.
/// If the device is lost, what the host has of the film becomes the checkpoint, and DeviceLost says so.
/// Throws as DeviceScene::render and read_film do.
Rendered render_job(DeviceScene& world, const View& view, const RenderJob& job, const std::filesystem::path& exr);

/// Deletes the checkpoint of a picture that has been written.
void finish_job(const std::filesystem::path& exr);

/// Prints a table of the errors over time, writes them as JSON beside the picture, and plots them if matplotlib is
/// installed.
void report_errors(const Rendered& rendered, const std::filesystem::path& exr);

}  // namespace ballot::cli
