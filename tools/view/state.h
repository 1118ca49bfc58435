// What the viewer shows and how: everything that keys, panels and scripts change.
#pragma once

#include <deque>
#include <optional>
#include <string>

#include "engine/ballot.h"

namespace ballot::view {

struct Settings {
  Query query;  // method, numeric mode and knobs
  Query other;  // of the right half while comparing
  bool compare = false;
  float divider = 0.5f;  // share of the width that the left half takes
  std::string rays = "primary", shading = "eyelight", heat = "nodes";
  int samples = 64;      // while the camera rests the picture is refined up to these; 1: not at all
  bool scale = true;     // fewer pixels while moving, to hold the target
  float target_ms = 50;  // of a frame while moving
  bool panels = true, help = false;

  bool operator==(const Settings& o) const;  // of what changes the picture
};

/// A frame's times, for the graph.
struct FrameRecord {
  LiveTimes times;
  double present_ms = 0;
  double wall_ms = 0;  // from frame to frame
};

/// What the inspector knows of the pixel under the mouse, or of a picked one.
struct Inspection {
  glm::uvec2 pixel{0};
  Probe probe;
  bool picked = false;  // with counters and the exact oracle's answer
  ExactHit exact;
  bool agrees = true;
  double t_ulp = 0;    // |t - exact t| in ulps of float32, where both hit the same triangle
  std::string reason;  // why not, or why the rounding explains it
};

/// What panels show besides the settings.
struct Facts {
  const Engine* engine = nullptr;
  std::string scene_file, view_name;
  std::deque<FrameRecord> frames;  // the newest last, those that traced something
  LiveTimes last;                  // of the newest
  double fps = 0;
  bool resting = false;                 // the picture is finished, and nothing moves
  std::uint32_t width = 0, height = 0;  // traced
  double scale = 1, speed = 0;
  std::uint32_t samples = 0;
  std::optional<Counters> counters, other_counters;  // on demand, of the view that is shown
  std::optional<Inspection> hovered, picked;
  std::string message;  // of the last action
  bool failed = false;  // the message is an error
  std::string shader_error;
};

/// What a panel asks the session to do.
struct Wishes {
  bool count = false, forget_pick = false;
};

}  // namespace ballot::view
