// Arrays of shapes: a row each. Internal to the readers of arrays.
#pragma once

#include <string>

#include "engine/files/load.h"
#include "engine/files/npy_rows.h"

namespace ballot {

/// Loads an array of shapes: rows of float32 or float64 that npy_shapes() lists. Throws Flaw unless they and the
/// options tell one kind alone, or as append_shapes() does.
Scene shapes_of(NpyFile& file, const LoadOptions& options);

/// Returns the arrays of shapes that there are, for messages.
std::string npy_shapes();

}  // namespace ballot
