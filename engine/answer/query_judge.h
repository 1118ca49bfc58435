// Judges answers to queries of points and crossings by the exact oracles, and by the bounds that are promised.
#pragma once

#include <cstdint>
#include <span>

#include "engine/answer/point_queries.h"
#include "engine/answer/ray_queries.h"
#include "engine/oracle/oracle_scene.h"
#include "engine/tree/device/device_tree.h"

namespace ballot {

/// How many answers were checked, how many differ from those of exact arithmetic, and how many of these by more than
/// their promised bound.
struct QueryErrors {
  std::uint64_t checked = 0, wrong = 0, beyond = 0;
  QueryErrors& operator+=(const QueryErrors& other);
};

/// The crossings that a query listed: how many each ray has, and those of all rays one after the other.
struct ListedCrossings {
  std::vector<std::uint32_t> counts;
  std::vector<Hit> hits;
};

/// The answers to queries of the same rays. Numbers and first crossings may be empty: these were not asked for.
struct RayAnswers {
  std::vector<std::uint32_t> counts;
  ListedCrossings lists, first;
  std::uint32_t most = 0;  // of each ray in `first`
};

struct RayErrors {
  QueryErrors counts, lists, first;
  RayErrors& operator+=(const RayErrors& other);
};

/// Judges on all cores. Keeps references to the tree's arrays on the host
/// and to its triangles.
class QueryJudge {
 public:
  /// Throws Error(Work) if the tree lacks a triangle that has an area, as the oracles would then lack it too.
  explicit QueryJudge(DeviceTree& tree);

  /// A list is wrong if triangles or their order differ. It is beyond its bound if a triangle differs that the ray
  /// meets or misses by more than the bound of shaders/lib/query/sure.glsl (of an instance, in the space of its mesh),
  /// or if a t differs by more than that. A number is wrong if it differs from the exact one, and beyond its bound if
  /// it differs from that of the list. First crossings are wrong if triangles or their order differ, and beyond their
  /// bound if they are not the beginning of the list.
  RayErrors rays(std::span<const Ray> rays, const RayAnswers& found) const;
  /// A nearest triangle is wrong if it is another one. It is beyond its bound if it, or the distance, is farther away
  /// than 64 * 2^-24 (M + M') + 2^-85 R allows (shaders/query/closest_point.comp), or if the distance exceeds the
  /// limit.
  QueryErrors nearest(std::span<const ProbePoint> points, std::span<const Nearest> found) const;
  /// Judges Nearest::behind. A side is wrong if it is not that of the exact nearest point. Of points whose nearest one
  /// is inside of a triangle it is beyond its bound if it is wrong although that is the triangle found, and the bound
  /// of the distance separates it from the triangle's plane and edges. At edges and corners no bound is judged.
  QueryErrors sides(std::span<const ProbePoint> points, std::span<const Nearest> found) const;
  /// An answer is beyond its bound if the point is 16 * 2^-24 M away from the surface (shaders/query/inside.comp); of
  /// an instance, in the space of its mesh.
  QueryErrors inside(std::span<const ProbePoint> points, std::span<const std::uint32_t> found) const;

 private:
  OracleScene scene_;
};

}  // namespace ballot
