// The picture of a window that an integrator makes. Paths take long, so a sample may be split over several calls.
#pragma once

#include <memory>

#include "engine/render/live/live_options.h"
#include "engine/render/path/waves.h"
#include "shaders/shared/window.h"

namespace ballot {

/// Returns the kernel that turns the film of an integrator into pixels.
KernelSource show_source();

/// The film of an integrator's picture on the device. Belongs to one thread.
class LivePaths {
 public:
  /// Keeps references to all arguments.
  LivePaths(Context& gpu, Tracer& tracer, SceneData& scene);

  /// Adds a sample, or the next part of one (LiveOptions::part_ms). Returns the times of the sample so far. The
  /// contract of LiveImage::add_sample() applies.
  LiveTimes add(const View& view, const LiveOptions& options, const Integrator& integrator);

  /// Writes the picture of finished samples to the window's pixels. Adds to times.shade_ms.
  void show(const LiveOptions& options, const Integrator& integrator, Buffer<std::uint32_t>& pixels, LiveTimes& times);

 private:
  void list_pixels(std::uint32_t width, std::uint32_t height);
  std::uint32_t next_part(double part_ms) const;
  void note_speed(std::uint32_t places, double ms);

  Context& gpu_;
  SceneData& scene_;
  Waves waves_;
  std::unique_ptr<Kernel> show_;
  std::unique_ptr<Buffer<std::uint32_t>> listed_;
  std::unique_ptr<Buffer<FilmPixel>> film_;
  std::uint32_t width_ = 0, height_ = 0;  // of the listed pixels
  std::uint32_t done_ = 0;                // listed pixels that have the current sample
  double places_a_ms_ = 0;                // of the last part; 0: unknown
  PassTimes passes_;                      // of the current sample
};

}  // namespace ballot
