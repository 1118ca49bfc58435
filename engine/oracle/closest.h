// The exact oracle of closest points: finds the triangle that is nearest to a point, without rounding, over the arrays
// that are uploaded to the device.
//
// Definition. Coordinates are taken as real numbers. The nearest triangle is that of the smallest exact distance, and
// of the smallest prim among those that are exactly as far. Triangles without area are in no leaf and are left out.
// Those of instances have the float32 corners of moved_corner() (engine/tree/host/moved_corners.h).
//
// Method. A walk of the scene in double precision (oracle_scene.h) finds the triangles that may be the nearest by a
// proved error bound. If there are several, features that are surely the same corner or edge are equally far; integers
// decide the others.
#pragma once

#include <functional>
#include <glm/vec3.hpp>
#include <utility>

#include "engine/oracle/oracle_scene.h"
#include "shaders/shared/query.h"

namespace ballot {

/// The nearest point of a triangle. `at`, u, v and the part are computed in double precision.
struct ExactClosest {
  double distance = 0;  // within 2^-45 of the largest distance of the triangle's vertices from the point
  std::uint32_t prim = NO_HIT;
  glm::dvec3 at{0};
  double u = 0, v = 0;
  std::uint32_t part = 0;     // of the triangle that the point is in (shaders/shared/query.h)
  bool part_is_sure = false;  // by a proved bound; else it was computed in double precision
};

/// The exact oracle of closest points of a scene. Thread-safe.
class ExactClosestPoints {
 public:
  /// The instances of the scene must not move.
  explicit ExactClosestPoints(OracleScene scene) : scene_(std::move(scene)) {}

  /// Returns the nearest triangle, if one is at most `limit` away: NO_HIT if not. `near` may be a triangle that is
  /// near, with its prim; it shortens the walk. Triangles that `keep` refuses are left out; it may be empty. A point
  /// that is not finite is near nothing.
  ExactClosest nearest(const glm::vec3& point, float limit, const std::pair<std::uint32_t, Triangle>* near = nullptr,
                       const std::function<bool(std::uint32_t prim)>& keep = {}) const;

 private:
  OracleScene scene_;
};

}  // namespace ballot
