// How far two scenes are apart: the smallest distance between triangles of the one and of the other.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "engine/core/triangle_distance.h"
#include "engine/oracle/oracle_scene.h"

namespace ballot {

/// A rotation with a translation, or any other matrix: rows of 3 and 1.
using PoseInDouble = std::array<std::array<double, 4>, 3>;

/// Two triangles, of a scene and of another one, that are nearest to each other.
struct Clearance {
  double distance = 0;
  std::uint32_t prim = NO_HIT, other_prim = NO_HIT;
  glm::dvec3 at{0}, other_at{0};  // the nearest points, in the space of the scene
};

/// Finds the smallest distance between two scenes, wherever the other one is placed. Thread-safe.
///
/// A walk of both trees at once, the nearest pairs of boxes first, in double precision on the host (Larsen, Gottschalk,
/// Lin, Manocha. Fast distance queries with rectangular swept sphere volumes. ICRA 2000, section 3): it sees few of the
/// pairs of triangles. Triangles are those of closest points (engine/tree/host/moved_corners.h); those of the other
/// scene are moved by the pose in double precision.
class ClearanceWalk {
 public:
  /// Keeps references to what the scenes refer to.
  ClearanceWalk(const OracleScene& scene, const OracleScene& other);
  ~ClearanceWalk();

  /// Returns the nearest pair of triangles; nothing if none is at most `limit` apart. The distance has the bound of
  /// triangle_distance(), and is the smallest up to twice that. Among pairs at the same distance it is that of the
  /// smallest prim, then of the smallest other_prim; of those at 0 it is one of them.
  std::optional<Clearance> find(const PoseInDouble& pose, double limit) const;

 private:
  class Side;
  class Walk;
  std::unique_ptr<const Side> side_, other_;
};

}  // namespace ballot
