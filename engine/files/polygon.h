// Cuts polygons into triangles. Internal to engine/files.
#pragma once

#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <string>
#include <vector>

namespace ballot {

/// Appends n - 2 triangles as indices into `polygon`, which has n >= 3 corners. Their areas add up to the polygon's, in
/// the projection along the largest axis of its normal. A convex polygon becomes a fan around its first corner, any
/// other is cut by ear clipping. Corners may repeat and lie on a line; edges may touch, and bridge to holes and back;
/// what has no area gets triangles without area. The work is about n log n, and bounded by a few thousand steps a
/// corner.
///
/// Returns false if the polygon is not simple: its edges cross, or it turns inside out. Then its triangles cover about
/// what it surrounds.
bool triangulate(std::span<const glm::vec3> polygon, std::vector<std::array<std::uint32_t, 3>>& triangles);

/// Counts the polygons of a file that are not simple, for a note.
class TangledPolygons {
 public:
  /// Counts a polygon unless it is simple. place() names it, such as "face 3".
  template <class Place>
  void add(bool simple, Place place) {
    if (!simple && count_++ == 0) first_ = place();
  }

  /// Appends a note if there were such polygons.
  void note(std::vector<std::string>& notes) const {
    if (count_ > 0)
      notes.push_back(fmt::format(
          "{} polygons, the first at {}, cross themselves; their triangles cover about as much.", count_, first_));
  }

 private:
  std::size_t count_ = 0;
  std::string first_;
};

}  // namespace ballot
