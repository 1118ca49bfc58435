// Point queries: the nearest point of a scene's triangles, and whether a point is inside of them.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>

#include "engine/answer/device_lists.h"
#include "engine/answer/filters.h"
#include "engine/answer/stream.h"
#include "shaders/shared/query.h"

namespace ballot {

using NearestStream = Stream<ProbePoint, Nearest>;
using InsideStream = Stream<ProbePoint, std::uint32_t>;  // 1 inside, 0 outside
using BoxStream = Stream<ProbeBox, std::uint32_t>;       // numbers of triangles
using WindingStream = Stream<ProbePoint, float>;

/// Takes the triangles of questions from number `first` on, such as those within the limits of points: how many each
/// has, and those of all one after the other, in order of distance, at equal distance in order of prim. The spans are
/// valid until it returns.
using TakeWithin =
    std::function<void(std::uint64_t first, std::span<const std::uint32_t> counts, std::span<const Within> triangles)>;

/// What is asked of points.
struct PointQuery {
  /// Decides as exact arithmetic does: which triangle is the nearest, the smallest prim of those as near; and what is
  /// inside. The host decides what the device leaves open. Distances are then exact to float32's rounding and 2^-45 of
  /// M.
  bool exact = false;
  /// Of nearest(): finds Nearest::behind. Takes 72 bytes a triangle for pseudonormals, counted through the instances.
  bool sides = false;
  /// Of winding(): a node of the tree counts as one if it is farther away than so many of its radii. At least 1.
  float beta = 2;
  /// Of nearest() without sides, and of within(), for points of the host.
  FilterReaders filters = {};
  /// A word for each triangle, counted through the instances; none: all bits. FILTER_MASK compares the point's with it.
  std::span<const std::uint32_t> triangle_masks = {};
};

/// Points of an array on the device.
struct DevicePoints {
  const Buffer<ProbePoint>& points;
  std::uint64_t count = 0;  // the first so many are asked
  DeviceFilters filters = {};
};

/// Returns the sources of all kernels of point and ray queries for a device.
std::vector<KernelSource> query_sources(const DeviceInfo& device);

/// Answers point queries on one tree or forest. Follows it when it changes. Belongs to the thread of its Context.
///
/// Among instances closest points are those of the triangles of all, their corners moved to the world in float32; by
/// the same corners, welded over all instances, are their sides (shaders/lib/query/point_instances.glsl). A point is
/// inside if it is so of an odd number of instances (shaders/lib/query/inside_instances.glsl).
class PointQueries {
 public:
  /// Keeps references to both. `blocks`: closest points of a subgroup are found together, in an order in which they are
  /// near each other (shaders/lib/query/closest_block.glsl), as is usual on GPUs; no answer depends on it.
  PointQueries(Context& gpu, DeviceTree& tree, std::optional<bool> blocks = {});
  ~PointQueries();

  /// Finds the nearest point of the triangles for each point, within its limit. The distance is that of the nearest
  /// triangle up to 64 * 2^-24 * (M + M') + 2^-85 R, with M and M' the largest distances of vertices of the reported
  /// and of the nearest triangle from the point, and R that of the scene's bounds along an axis
  /// (shaders/query/closest_point.comp has the proof). Among triangles at the same
  /// computed distance it is the one with the smallest number; those that share an edge or a vertex compute the same
  /// for it. Triangles without area are left out. Dead points have no nearest triangle. Throws Error(Work) if the
  /// device fails.
  ///
  /// With query.sides, and P the point and C its nearest one, `behind` is the sign of N . (P - C): with N the normal of
  /// the triangle where C is inside of it, else the pseudonormal of its corner or edge
  /// (engine/tree/host/pseudonormals.h). A point on the surface is not behind it. With query.exact it is the sign for
  /// the exact C, and for the vectors N as they are rounded to float32.
  TraceTimes nearest(const NearestStream& stream, const PointQuery& query = {});
  TraceTimes nearest(std::span<const ProbePoint> points, std::span<Nearest> answers, const PointQuery& query = {});

  /// Finds whether each point is inside, by the parity of the crossings of one ray along +x. For a mesh whose every
  /// edge belongs to an even number of triangles the answer is right unless the point is nearer to the surface than
  /// 16 * 2^-24 * M, with M the largest distance of a vertex of a triangle that near (shaders/query/inside.comp has the
  /// proof). Among instances each mesh is to be so, and the bound is e + s * 16 * 2^-24 * M: with M in the space of the
  /// mesh, s the largest stretch of the instance's matrix, and e for the rounded point there: 5.1 * 2^-24 times the
  /// matrix times its inverse, both of magnitudes, times the point's distances from the translation along the axes.
  /// Dead points are outside. Limits are ignored. Throws as nearest().
  TraceTimes inside(const InsideStream& stream, const PointQuery& query = {});
  TraceTimes inside(std::span<const ProbePoint> points, std::span<std::uint32_t> answers, const PointQuery& query = {});
  /// For tests: whether inside() answers by cells (inside_cells.h) where it can; none: where it pays. The bits are the
  /// same.
  void set_cells_pay(std::optional<bool> pay);
  /// For tests: whether the tree as it was last asked for has cells.
  bool has_cells() const;

  /// Finds the winding number of the triangles around each point: the sum of their solid angles over 4 pi, each
  /// positive where the point sees its back (shaders/query/winding.comp). Far nodes count by three terms of a series
  /// (query.beta); tools/measured/queries.md has the error. 0 for dead points; limits are ignored. Throws as nearest(),
  /// and Error(Arguments) for instances, shapes, query.exact and a beta that is too small.
  TraceTimes winding(const WindingStream& stream, const PointQuery& query = {});
  TraceTimes winding(std::span<const ProbePoint> points, std::span<float> answers, const PointQuery& query = {});
  TraceTimes winding(const DevicePoints& points, Buffer<float>& answers, const PointQuery& query = {});

  /// Finds all triangles whose distance from a point is at most its limit. A distance is the one that nearest()
  /// computes for that triangle, bit for bit, and with its bound. Triangles without area are left out. Dead points have
  /// none; with an infinite limit a point has all. stream.take is not called. Throws Error(Arguments) with query.exact:
  /// distances are computed in float32. Else as nearest().
  TraceTimes within(const InsideStream& stream, const TakeWithin& take, const PointQuery& query = {});

  /// The same for points of an array on the device, whose order is kept, with filters of theirs. The bits are the
  /// same. On a GPU the host sees no more than the number of all triangles, unless a list has more than 16384: then
  /// points and lists pass through its memory. Throws Error(Arguments) if an array has too few records.
  DeviceListed within(const DevicePoints& points, const DeviceLists<Within>& to, const PointQuery& query = {});
  /// The same as hits: t is the distance, u and v are 0.
  DeviceListed within(const DevicePoints& points, const DeviceLists<Hit>& to, const PointQuery& query = {});

  /// Finds all triangles that have a point in common with each closed box: those of exact arithmetic, as the host
  /// decides what the device leaves open (shaders/lib/query/overlap.glsl). Distances are 0. Among instances triangles
  /// are those of corners moved to the world, rounded to float32. Triangles without area are left out. stream.take is
  /// not called. Throws Error(Arguments) for scenes of shapes; else as nearest().
  TraceTimes overlapping(const BoxStream& stream, const TakeWithin& take, const PointQuery& query = {});

  /// nearest(), also with filters, and inside() for points of an array on the device, whose answers go to the same
  /// places of another. Without blocks neighbours share a subgroup, so points that are near each other are best next to
  /// each other. The host sees points and answers only with query.exact, and where the driver cuts walks short. Throw
  /// Error(Arguments) if an array has too few records, or with filters and query.sides.
  TraceTimes nearest(const DevicePoints& points, Buffer<Nearest>& answers, const PointQuery& query = {});
  TraceTimes inside(const DevicePoints& points, Buffer<std::uint32_t>& answers, const PointQuery& query = {});

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace ballot
