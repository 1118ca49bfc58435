// Ray queries for more than one hit: how often a ray crosses the surface, and where.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "engine/answer/device_lists.h"
#include "engine/answer/filters.h"
#include "engine/answer/stream.h"
#include "shaders/shared/query.h"

namespace ballot {

/// The rays of a query, which are asked for in parts and in order.
struct RaySource {
  std::uint64_t count = 0;
  /// Writes the rays from number `first` on. Called once for each part.
  std::function<void(std::uint64_t first, std::span<Ray> room)> read;
  /// As Stream::make, with read() for next().
  MakeQuestions<Ray> make = {};
  /// Is called after each part with the number of rays that are done. May throw to end the query. May be empty.
  std::function<void(std::uint64_t done)> progress = {};
  FilterReaders filters = {};
};

/// Rays of an array on the device.
struct DeviceRays {
  const Buffer<Ray>& rays;
  std::uint64_t count = 0;  // the first so many are asked
  DeviceFilters filters = {};
};

/// All crossings of a ray: no limit.
constexpr std::uint32_t kAllHits = 0xFFFFFFFFu;

/// The triangles that are left out: none, those that a ray meets from behind, those that it meets from the front. The
/// front is the side from which the vertices run counter-clockwise.
enum class Cull : std::uint32_t { None = CULL_NONE, Back = CULL_BACK, Front = CULL_FRONT };

/// What kernels need to read the alpha of a scene's surfaces.
struct SurfaceAlpha {
  Defines defines = {};                    // of shaders/lib/shade/surface_material.glsl; none: every surface is opaque
  std::function<void(Kernel&)> bind = {};  // binds what such a kernel reads
};

/// What is asked of crossings. What is not asked for is in no kernel.
struct CrossingQuery {
  /// list(): the first crossings of each ray that are wanted. 0: none, and nothing is traced. Up to 16 are
  /// looked for no farther than they lie, of more all crossings are listed first. count() tells how many there are.
  std::uint32_t most = kAllHits;
  /// first() of one, not in mode exact: any crossing will do, whichever is found first. The walk ends there.
  bool any = false;
  /// first() of up to 16: the last crossings, the farthest first, at equal t the smallest prim.
  bool last = false;
  /// Decides as exact arithmetic does, and orders by the exact t. The device decides what a proved bound lets it
  /// decide, the host the rest. t, u and v are then exact to float32's rounding and 2^-30.
  bool exact = false;
  Cull cull = Cull::None;
  /// A word for each triangle, counted through the instances; none: all bits. FILTER_MASK compares the ray's with it.
  std::span<const std::uint32_t> triangle_masks = {};
  /// Leaves out a triangle where its surface stops nothing: where alpha is below the cutoff of a mask, or 0. Changes
  /// nothing in a scene whose surfaces are opaque. Not in mode exact: textures are read in float32.
  bool alpha = false;
};

/// Takes the numbers of crossings of the rays from number `first` on. The span is valid until it returns.
using TakeCounts = std::function<void(std::uint64_t first, std::span<const std::uint32_t> counts)>;
/// Takes the crossings of the rays from number `first` on: how many each ray has, and those of all rays one after the
/// other, in order of t, at equal t in order of prim. The spans are valid until it returns.
using TakeLists =
    std::function<void(std::uint64_t first, std::span<const std::uint32_t> counts, std::span<const Hit> hits)>;

/// Takes the first crossings of the rays from number `first` on: as many for each ray as were asked for, in order, and
/// in the place of those that a ray lacks misses: prim NO_HIT, t infinite, u and v zero. The span is valid until it
/// returns.
using TakeFirst = std::function<void(std::uint64_t first, std::span<const Hit> hits)>;

/// Returns the sources of kernels of crossings that read alpha, for a device and a tree with these facts.
std::vector<KernelSource> alpha_crossing_sources(const DeviceInfo& device, const TreeFacts& tree, const Defines& alpha);

/// Answers ray queries on a tree or a forest. Follows it when it changes. Belongs to the thread of its Context.
///
/// A ray crosses a triangle by a rule of symbolic perturbation: a ray that passes exactly through an edge or a vertex
/// is moved by an infinitesimal step, the same for all triangles. So it crosses a closed surface there once, or twice
/// or not at all where it touches the surface from one side. Each triangle counts once, as the tree that is walked has
/// no spatial splits: if the scene's own has, another one is built for these queries. What the crossings of instances
/// are is told in shaders/lib/tree/instances.glsl; their triangles are numbered through the instances.
class RayQueries {
 public:
  /// Keeps references to gpu and tree.
  RayQueries(Context& gpu, DeviceTree& tree, SurfaceAlpha alpha = {});
  ~RayQueries();

  /// Counts the crossings of each ray with t in [t_min, t_max]. Dead rays have none. Throws Error(Arguments) if there
  /// are not as many masks as triangles or alpha is asked for in mode exact, Error(Work) if the device fails.
  TraceTimes count(const RaySource& rays, const TakeCounts& take, const CrossingQuery& query = {});

  /// Lists the crossings of each ray. Takes memory for some 2^22 crossings a chunk of rays; a ray with more gets memory
  /// of its own. Throws as count().
  TraceTimes list(const RaySource& rays, const TakeLists& take, const CrossingQuery& query = {});

  /// Finds the first `most` crossings of each ray, with the bits that list() has. What query.most says does not count.
  /// Up to 16 are looked for no farther than they lie. Throws as count(), and Error(Arguments) if `most` is 0, or above
  /// 16 with query.last.
  TraceTimes first(const RaySource& rays, std::uint32_t most, const TakeFirst& take, const CrossingQuery& query = {});

  /// The same for arrays on the device, in the order of their rays. Counts, lists and rows have the bits of those
  /// above. Neighbours share a subgroup, so rays that are alike should be next to each other. On a GPU the host sees no
  /// more than the number of all crossings, but in mode exact, and if a ray has more than 16384: then rays and lists
  /// pass through its memory. Throw as count(), and Error(Arguments) if an array has too few records. Rays and results
  /// must not overlap.
  TraceTimes count(const DeviceRays& rays, Buffer<std::uint32_t>& counts, const CrossingQuery& query = {});
  DeviceListed list(const DeviceRays& rays, const DeviceLists<Hit>& to, const CrossingQuery& query = {});
  /// Writes rows of `most` hits.
  TraceTimes first(const DeviceRays& rays, std::uint32_t most, Buffer<Hit>& hits, const CrossingQuery& query = {});

  /// Writes those of the first `count` hits on the device that are no misses one after the other, in their order, and
  /// the number of the ray of each, of which there are rows of `row` hits. Returns how many there are; what there is no
  /// room for is not written. The arrays must not overlap.
  DeviceListed hits_alone(const Buffer<Hit>& hits, std::uint64_t count, std::uint32_t row, Buffer<Hit>& to,
                          Buffer<std::uint32_t>& numbers);

  Context& context();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace ballot
