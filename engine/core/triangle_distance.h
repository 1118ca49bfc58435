// The distance of two triangles, in double precision.
#pragma once

#include <array>
#include <glm/vec3.hpp>

namespace ballot {

using TriangleInDouble = std::array<glm::dvec3, 3>;

/// Two triangles where they are the nearest.
struct TriangleGap {
  double distance = 0;
  glm::dvec3 a{0}, b{0};  // the nearest points
};

/// Returns the distance of two closed triangles, of which either may be thin or without area, and two points that are
/// so far apart. With M the largest distance of two of the corners, the distance is off by 2^-50 M at most, as was
/// measured beside quadruple precision (tests/cpu/test_triangle_distance.cpp), and the points by as much, but for those
/// of edges that are nearly parallel, which may lie elsewhere along them. Coordinates must be below 2^250 in size, as
/// products of four are formed. It is 0 if an edge of one passes through the other.
TriangleGap triangle_distance(const TriangleInDouble& a, const TriangleInDouble& b);

}  // namespace ballot
