// The way a kernel reads a tree on the device.
#pragma once

#include "engine/formats/pair.h"

namespace ballot {

/// The kind of buffer that nodes and triangles are read through. Values are in the order of the names in trace/knobs.h.
enum class Fetch { Storage, Texel, Reference };

/// Boxes are widened by each ray, or once, in the tree.
enum class Padding { Ray, Tree };

struct TreeAccess {
  NodeLayout layout = NodeLayout::Interleaved;
  Padding padding = Padding::Ray;
  Fetch fetch = Fetch::Storage;
  std::uint32_t frontier = 64;  // nodes of a frontier
};

}  // namespace ballot
