// Orders of queries in which neighbours walk the same part of the tree. Internal to engine/answer.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/core/geometry.h"
#include "shaders/shared/query.h"

namespace ballot {

/// Writes the order of points along a Morton curve through the bounds to `order`: its entry k is the number of the
/// point at place k.
void order_points(std::span<const ProbePoint> points, const Bounds& bounds, std::vector<std::uint32_t>& order);
/// The same for boxes, by their middles.
void order_boxes(std::span<const ProbeBox> boxes, const Bounds& bounds, std::vector<std::uint32_t>& order);

/// The same for rays: by their direction, in eight parts of each octant, then along a Morton curve by their origin.
/// Returns false, and no order, if most neighbours are alike already.
bool order_rays(std::span<const Ray> rays, const Bounds& bounds, std::vector<std::uint32_t>& order);

}  // namespace ballot
