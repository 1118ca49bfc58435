// The viewer's state: the settings that keys, panels and scripts change, and the facts that panels show.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "engine/ballot.h"

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
  Query other;  // the query of the right half while comparing
  bool compare = false;
  float divider = 0.5f;  // share of the width that the left half takes
  std::string rays = "primary", shading = "eyelight", heat = "nodes";
  int samples = 64;   // samples per pixel up to which the picture is refined while the camera rests; 1: no refinement
  bool scale = true;  // trace fewer pixels while moving, to meet the target
  float target_ms = 50;  // target time of a frame while moving
  bool panels = true, help = false;
  Playback play;

  /// Returns the integrator that `shading` names; null if it names a shading of primary hits.
  const Integrator* integrator() const { return find_integrator(shading); }
  bool compares() const { return compare && !integrator(); }
  bool heats() const { return !integrator() && find_shading(shading).heat; }

  bool operator==(const Settings& o) const;  // compares only the settings that change the picture
};

/// The times of a frame, for the graph.
struct FrameRecord {
  double pose_ms = 0, tree_ms = 0;  // of a scene that moves
  LiveTimes times;
  double present_ms = 0;
  double wall_ms = 0;  // time from frame to frame
};

/// The inspector's data on the pixel under the mouse, or on a picked one.
struct Inspection {
  glm::uvec2 pixel{0};
  Probe probe;
  bool picked = false;  // then probe has counters, and the members below hold the exact oracle's answer
  ExactHit exact;
  bool agrees = true;
  double t_ulp = 0;    // |t - exact t| in ulps of float32, if both hit the same triangle
  std::string reason;  // why the answer is wrong, or why rounding errors explain the difference
};

/// The data that panels show besides the settings.
struct Facts {
  const Engine* engine = nullptr;
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
  std::optional<Counters> counters, other_counters;  // of the view that is shown; counted on demand
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
