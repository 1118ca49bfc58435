// The viewer's state: the settings that keys and panels change, and the facts that panels show.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "engine/scene/device_scene.h"

namespace ballot::view {

/// A row of shadings().
struct NamedShading {
  std::string_view name, summary;
};
/// Returns what a window can draw: the shadings of primary hits, then the integrators.
const std::vector<NamedShading>& shadings();
/// Returns the full name of a shading of a window. Throws Error(Arguments) that lists the known names.
std::string shading_named(const std::string& name);

/// What plays of a scene's animation. At first the scene is at rest.
struct Playback {
  std::size_t clip = 0;
  double seconds = 0;
  bool playing = false;
  float speed = 1;  // seconds of the clip a second
  UpdateMode update = UpdateMode::Auto;
};

struct Settings {
  Query query;  // method, numeric mode and knobs
  std::string rays = "primary", shading = "eyelight", heat = "nodes";
  int samples = 64;   // samples per pixel up to which the picture is refined while the camera rests; 1: no refinement
  bool scale = true;  // trace fewer pixels while moving, to meet the target
  float target_ms = 50;  // target time of a frame while moving
  bool panels = true, help = false;
  Playback play;

  /// Returns the integrator that `shading` names; null if it names a shading of primary hits.
  const Integrator* integrator() const { return find_integrator(shading); }
  bool heats() const { return !integrator() && find_shading(shading).heat; }

  bool operator==(const Settings& o) const;  // compares only the settings that change the picture
};

/// The milliseconds of a frame.
struct FrameRecord {
  double pose = 0, tree = 0;  // of a scene that moves
  double rays = 0, trace = 0, shade = 0, show = 0;
  double wall = 0;  // time from frame to frame
};

/// A part of a frame's time.
struct FramePass {
  const char* name;
  double FrameRecord::*ms;
  bool moves;  // only scenes that move have it
};
inline constexpr FramePass kFramePasses[] = {
    {"pose", &FrameRecord::pose, true},    {"tree", &FrameRecord::tree, true},    {"rays", &FrameRecord::rays, false},
    {"trace", &FrameRecord::trace, false}, {"shade", &FrameRecord::shade, false}, {"show", &FrameRecord::show, false}};

/// The inspector's data on the pixel under the mouse, or on a picked one.
struct Inspection {
  glm::uvec2 pixel{0};
  Probe probe;
  bool picked = false;  // then probe has counters
  bool judged = false;  // the members below hold the exact oracle's answer, which knows triangles alone
  ExactHit exact;
  bool agrees = true;
  double t_ulp = 0;    // |t - exact t| in ulps of float32, if both hit the same triangle
  std::string reason;  // why the answer is wrong, or why rounding errors explain the difference
};

/// The data that panels show besides the settings.
struct Facts {
  const DeviceScene* world = nullptr;
  std::string scene_file, view_name;
  std::deque<FrameRecord> frames;  // the frames that traced something, the newest last
  LiveTimes last;                  // the times of the newest
  double fps = 0;
  double pose_ms = 0, tree_ms = 0;      // of the last time that was set
  bool refitted = false;                // then
  bool resting = false;                 // the picture is finished and nothing moves
  std::uint32_t width = 0, height = 0;  // traced pixels
  double scale = 1, speed = 0;
  std::uint32_t samples = 0;
  std::optional<Counters> counters;  // of the view that is shown; counted on demand
  std::optional<Inspection> hovered, picked;
  std::string message;  // the result of the last action
  bool failed = false;  // the message is an error
  std::string shader_error;
};

/// The actions that a panel asks the session for.
struct Wishes {
  bool count = false, forget_pick = false;
};

}  // namespace ballot::view
