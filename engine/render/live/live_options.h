// What a window's picture is made by, and what that took.
#pragma once

#include <cstdint>
#include <string>

#include "engine/answer/query.h"

namespace ballot {

/// The options of one sample.
struct LiveOptions {
  std::uint32_t width = 1280, height = 720;  // pixels, 1 to 16384 each
  std::uint32_t sample_index = 0;            // 0 begins a new picture; else one sample is added to the current one
  std::uint32_t sample_count = 1;            // 1: at pixel centres; more: jittered
  std::string rays = "primary";              // the ray kind to show; secondary kinds start one ray per hit
  /// A name of kShadings, which applies to nearest hits ("heat" shows the work of this kind's rays), or of
  /// kIntegrators, which trace rays of their own: `rays` is then "primary".
  std::string shading = "eyelight";
  std::string heat = "nodes";  // the quantity that shading "heat" shows
  Query query = {};            // query.want is replaced by the ray kind's
  float ao_radius = 0.05f;     // length of ao rays: share of the scene's diagonal, above 0
  /// Of an integrator: about how long a call may take; it then leaves pixels out that later calls add. 0: no limit.
  double part_ms = 0;
  bool goes_on = false;  // with the sample that the last call did not finish (LiveTimes::finished)
};

/// The device milliseconds and counts of one sample, as far as it is done.
struct LiveTimes {
  double generate_ms = 0;  // making the primary rays, and this kind's rays from their hits
  double primary_ms = 0;   // tracing the primary rays if the kind is a secondary one
  double trace_ms = 0;     // tracing this kind's rays
  double shade_ms = 0;     // shading hits into the film, and the film into pixels
  std::uint64_t rays = 0;  // live rays of the kind; with heat maps, those of the first sample
  float heat_top = 0;      // the value of the last colour of a heat map
  bool finished = true;    // false: some pixels lack the sample yet, and the picture is the one before it
  double total_ms() const { return generate_ms + primary_ms + trace_ms + shade_ms; }
  double mrays_per_s() const { return trace_ms > 0 ? double(rays) / trace_ms * 1e-3 : 0; }
};

}  // namespace ballot
