// What answers ray queries for more than one hit. Internal to engine/answer.
#pragma once

#include <limits>
#include <optional>
#include <vector>

#include "engine/answer/coherent_order.h"
#include "engine/answer/crossing_kernels.h"
#include "engine/answer/exact_lists.h"
#include "engine/answer/lists.h"

namespace ballot {

// Named, as RayQueries::Parts holds types of it.
namespace ray_queries {

constexpr std::uint32_t kMostFirst = 16;  // first crossings that a kernel looks for; of more, all are listed
constexpr std::uint32_t kRow = 8;         // crossings of a row, if all are listed
constexpr std::size_t kFewRays = 1024;    // fewer are not sorted
constexpr Hit kMiss{std::numeric_limits<float>::infinity(), NO_HIT, 0, 0};

/// Throws Error(Arguments) if so many first or last crossings cannot be asked for.
void check_most(std::uint32_t most, const CrossingQuery& query);

/// A count of crossings, to which those of another piece of the tree are added.
inline void add_count(std::uint32_t& all, std::uint32_t found) {
  all = all == UNSURE || found == UNSURE ? UNSURE : all + found;
}

}  // namespace ray_queries

struct RayQueries::Parts {
  using RayPart = ListPart<Ray>;

  Parts(Context& device, DeviceTree& scene, SurfaceAlpha alpha)
      : gpu(device), kernels(device, scene, std::move(alpha)) {}

  /// Begins a query: makes its kernels for the present tree. `filters`: those that its rays have words for.
  void begin(std::uint32_t filters, const CrossingQuery& wanted);
  bool count_there(const DeviceRays& there, Buffer<std::uint32_t>& counts, TraceTimes& times);
  bool first_there(const DeviceRays& there, Buffer<Hit>& hits, TraceTimes& times);
  class CountAnswerer;
  class FirstAnswerer;
  class Crossings;

  Context& gpu;
  CrossingKernels kernels;
  CrossingQuery query;
  CrossingVariant variant;
  std::optional<ExactLists> exact_lists;  // of a query in mode exact
  ListRooms<Ray, Hit> rooms;
  std::unique_ptr<Buffer<std::uint32_t>> numbers;  // of first crossings of the rays of a chunk
};

}  // namespace ballot
