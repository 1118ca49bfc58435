// Arrays of heights: a raster. Internal to the readers of arrays.
#pragma once

#include "engine/files/load.h"
#include "engine/files/npy_file.h"

namespace ballot {

/// Loads a raster of float32 or float64 heights, rows by columns. Throws Flaw for any other array, or if its heights
/// or the options make no grid.
Scene heights_of(NpyFile& file, const LoadOptions& options);

}  // namespace ballot
