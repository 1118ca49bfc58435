// The way in which a kernel reads the tree on the device.
#pragma once

#include <compare>

#include "engine/tree/formats/pair.h"

namespace ballot {

/// The kind of buffer that nodes and triangles are read through. Values are in the order of the names in
/// answer/knobs.h.
enum class Fetch { Storage, Texel, Reference };

/// Where boxes are padded: by each ray, or once in the tree.
enum class Padding { Ray, Tree };

/// The parts of a kernel configuration that decide which arrays of the tree a kernel reads.
struct TreeAccess {
  NodeLayout layout = NodeLayout::Interleaved;
  Padding padding = Padding::Ray;
  Fetch fetch = Fetch::Storage;
  auto operator<=>(const TreeAccess&) const = default;
};

}  // namespace ballot
