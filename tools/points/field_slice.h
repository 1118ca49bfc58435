// A picture of a slice of a distance field.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "engine/scene/device_scene.h"

namespace ballot::cli {

/// A plane of a field of `side` points along each axis.
struct FieldSlice {
  int axis = 2;             // 0, 1, 2: x, y, z
  std::uint32_t index = 0;  // along that axis; all points of the plane have it
};

/// Reads AXIS=SHARE: x, y or z, and where the plane lies from the first point, 0, to the last, 1. Throws
/// Error(Arguments).
FieldSlice parse_slice(const std::string& text, std::uint32_t side);

/// Draws a slice, a pixel for each point: of the other two axes the first runs to the right, the second upwards.
/// Distances are blue, negative ones orange, darker the farther they are. Lines are at multiples of a sixteenth of the
/// slice's largest distance. A black line is where the sign changes. Points without a distance are grey. `distances`
/// are those of a volume [z][y][x].
Image draw_slice(std::span<const float> distances, std::uint32_t side, const FieldSlice& slice);

}  // namespace ballot::cli
