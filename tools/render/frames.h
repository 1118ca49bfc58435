// The times of an animation that the command render draws, and the files of their frames.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tools/program/cli.h"

namespace ballot::cli {

/// The options that choose times of an animation.
struct FrameArgs {
  std::string animation, frames, part, update{"auto"};
  std::optional<double> time, fps;

  void add_to(CLI::App& cmd);
  void add_range_to(CLI::App& cmd);  // --frames, --fps, --animation alone
  /// Checks what can be checked without the scene. Throws Error(Arguments).
  void check() const;
};

/// A time that is drawn.
struct Frame {
  std::uint32_t number = 0;
  double seconds = 0;  // in the clip
};

/// The times that a command draws.
struct FramePlan {
  std::size_t clip = 0;
  std::string animation;  // the name of the clip; empty: the scene is drawn at rest
  bool numbered = false;  // --frames: each frame has files of its own
  std::vector<Frame> frames{{}};
  UpdateMode update = UpdateMode::Auto;
};

/// Whether times outside the clip are said on standard error.
enum class Outside { Said, Silent };

/// Makes the plan. Throws Error(Arguments) if the scene has no such animation.
FramePlan plan_frames(const FrameArgs& args, const Scene& scene, Outside outside = Outside::Said);

/// Returns the update mode of this name. Throws Error(Arguments) that lists the names.
UpdateMode find_update(std::string_view name);
std::string_view update_name(UpdateMode mode);

/// Returns the file of a frame: NAME-0007.exr for NAME.exr.
std::filesystem::path frame_file(const std::filesystem::path& exr, std::uint32_t frame);

/// Returns what decides the bits of a view's frames, but for their time, as a short text. The scene must be at rest.
std::string job_of(const DeviceScene& world, const View& view, const RenderOptions& options);

/// Adds to a picture what tells its frame, and whether a later run has to draw it again.
void label_frame(Image& image, const FramePlan& plan, const Frame& frame, const std::string& job);

/// Returns true if the file is a whole picture of this frame by this job.
bool has_frame(const std::filesystem::path& exr, const FramePlan& plan, const Frame& frame, const std::string& job);

}  // namespace ballot::cli
