// Polygons in the plane, and whether their edges cross. Internal to engine/files.
#pragma once

#include <glm/vec2.hpp>
#include <vector>

namespace ballot {

/// A polygon in the plane, counter-clockwise.
struct FlatPolygon {
  std::vector<glm::dvec2> points;
  double rounding = 0;  // how far rounding to float may have moved a corner, with some room
};

/// Returns twice the area of a triangle, positive if it is counter-clockwise.
inline double flat_cross(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// Returns true if edges of a polygon cross by more than rounding explains. Edges that touch or lie on each other do
/// not cross. Takes n log n steps.
bool crosses_itself(const FlatPolygon& polygon);

}  // namespace ballot
