// The overlay's panels: ImGui calls that show settings and facts, built from the registries of methods, numeric modes
// and knobs.
#pragma once

#include "tools/view/state.h"

namespace ballot::view {

/// Draws all panels. The panels change `settings`; the result holds what they ask the session to do.
Wishes draw_panels(Settings& settings, const Facts& facts);

/// Draws method, numeric mode and knobs of a query. `label` is an ImGui id that distinguishes two such groups.
void draw_query(const char* label, Query& query, const DeviceInfo& device);

/// Draws a graph of the times of the last frames, stacked by pass, and its legend.
void draw_times(const Facts& facts, bool compare);

/// Draws what plays of an animation, if the scene has one, and what its tree costs.
void draw_play(Settings& settings, const Facts& facts);

void draw_inspector(const Facts& facts, Wishes& wishes);
void draw_help();

}  // namespace ballot::view
