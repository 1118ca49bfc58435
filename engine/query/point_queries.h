// Point queries: the nearest point of a scene's triangles, and whether a point is inside of them.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>

#include "engine/trace/dispatch.h"
#include "shaders/shared/query.h"

namespace ballot {

/// The points of a query, which are asked for in parts and in order.
struct PointStream {
  std::uint64_t count = 0;
  /// Writes the points from number `first` on.
  std::function<void(std::uint64_t first, std::span<ProbePoint> room)> read;
  /// Is called after each part with the number of points that are done. May throw to end the query. May be empty.
  std::function<void(std::uint64_t done)> progress = {};
};

/// Takes the answers of the points from number `first` on. The span is valid until it returns.
using TakeNearest = std::function<void(std::uint64_t first, std::span<const Nearest> answers)>;
/// The same for the inside test: 1 inside, 0 outside.
using TakeInside = std::function<void(std::uint64_t first, std::span<const std::uint32_t> answers)>;

/// What is asked of points.
struct PointQuery {
  /// Decides as exact arithmetic does: which triangle is the nearest, the smallest prim of those as near; and what is
  /// inside. The host decides what the device leaves open. Distances are then exact to float32's rounding and 2^-45 of
  /// M.
  bool exact = false;
};

/// Returns the sources of all kernels of point and ray queries for a device.
std::vector<KernelSource> query_sources(const DeviceInfo& device);

/// Answers point queries on one tree. Follows the tree when it changes. Belongs to the thread of its Context.
class PointQueries {
 public:
  /// Keeps references to both.
  PointQueries(Context& gpu, DeviceTree& tree);
  ~PointQueries();

  /// Finds the nearest point of the triangles for each point, within its limit. The distance is that of the nearest
  /// triangle up to 64 * 2^-24 * (M + M'), with M and M' the largest distances of vertices of the reported and of the
  /// nearest triangle from the point (shaders/query/closest_point.comp has the proof). Among triangles at the same
  /// computed distance it is the one with the smallest number; those that share an edge or a vertex compute the same
  /// for it. Triangles without area are left out. Dead points have no nearest triangle. Throws Error(Work) if the
  /// device fails.
  TraceTimes nearest(const PointStream& points, const TakeNearest& take, const PointQuery& query = {});
  TraceTimes nearest(std::span<const ProbePoint> points, std::span<Nearest> answers, const PointQuery& query = {});

  /// Finds whether each point is inside, by the parity of the crossings of one ray along +x. For a mesh whose every
  /// edge belongs to an even number of triangles the answer is right unless the point is nearer to the surface than
  /// 16 * 2^-24 * M, with M the largest distance of a vertex of a triangle that near (shaders/query/inside.comp has the
  /// proof). Dead points are outside. Limits are ignored. Throws as nearest().
  TraceTimes inside(const PointStream& points, const TakeInside& take, const PointQuery& query = {});
  TraceTimes inside(std::span<const ProbePoint> points, std::span<std::uint32_t> answers, const PointQuery& query = {});

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace ballot
