// The overlay's panels: ImGui calls over settings and facts, built from the registries of methods, modes and knobs.
#pragma once

#include "tools/view/state.h"

namespace ballot::view {

/// Draws all panels; `mouse_free` says that the pointer belongs to the picture.
Wishes draw_panels(Settings& settings, const Facts& facts);

/// Method, numeric mode and knobs of a query. `label` keeps two of them apart.
void draw_query(const char* label, Query& query, const DeviceInfo& device);

/// Times of the last frames, stacked by pass, and their legend.
void draw_times(const Facts& facts, bool compare);

void draw_inspector(const Facts& facts, Wishes& wishes);
void draw_help();

}  // namespace ballot::view
