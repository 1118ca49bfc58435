// The runners of point queries, which calls for points of the host and of the device share. Internal to engine/answer.
#pragma once

#include <array>
#include <map>
#include <utility>

#include "engine/answer/lists.h"
#include "engine/answer/moments.h"
#include "engine/answer/point_instances.h"
#include "engine/answer/point_runner.h"
#include "engine/answer/pseudonormal_array.h"

namespace ballot {

/// Each runner is made when it is first asked for.
struct PointQueries::Parts {
  template <class Kind>
  using Runner = point_queries::Runner<Kind>;
  using NearestRunner = Runner<point_queries::NearestQuery>;
  using InsideRunner = Runner<point_queries::InsideQuery>;

  /// Parity needs each triangle once, so that query walks a tree without spatial splits.
  Parts(Context& device, DeviceTree& tree, bool in_blocks)
      : gpu(device),
        scene(tree),
        whole(device, tree),
        point_filters(device),
        within_filters(device),
        blocks(in_blocks),
        order(device),
        cells(device),
        moments(device) {}

  /// Return the runner of a query, prepared for the tree as it is now. `filters`: those that its points have words
  /// for.
  NearestRunner& nearest(const PointQuery& query, std::uint32_t filters);
  /// `points`: how many the call asks for.
  InsideRunner& inside(const PointQuery& query, std::uint64_t points);
  Runner<point_queries::WindingQuery>& winding(const PointQuery& query);
  /// Returns what inside() and lists walk, as it is now.
  DeviceTree& whole_tree();
  /// Return what settles the answers of a query; empty unless it is to be exact.
  point_queries::Settle<Nearest> settle_nearest(const PointQuery& query);
  point_queries::Settle<std::uint32_t> settle_inside(const PointQuery& query);
  template <class Question>
  class TriangleLists;
  class WithinLists;
  class OverlapLists;
  template <class Question>
  TraceTimes list(TriangleLists<Question>& kind, ListRooms<Question, Within>& rooms,
                  const Stream<Question, std::uint32_t>& stream, const TakeWithin& take);

  Context& gpu;
  DeviceTree& scene;
  WholeTree whole;
  QueryFilters point_filters, within_filters;
  std::map<std::pair<bool, std::uint32_t>, std::optional<NearestRunner>> closest;  // by sides, filters
  std::map<std::pair<bool, bool>, std::optional<InsideRunner>> inside_tests;       // by exact, by cells
  /// Of lists, by name: by filters, LISTS_..., row.
  std::map<std::string, std::map<std::array<std::uint32_t, 3>, QueryKernel>> lists_by;
  const bool blocks;  // closest points of a subgroup are found together; on a CPU voting takes longer
  PointOrder order;   // for that
  InsideCells cells;  // of the whole tree
  std::optional<Runner<point_queries::WindingQuery>> winding_numbers;
  Moments moments;  // of the whole tree
  ListRooms<ProbePoint, Within> lists;
  ListRooms<ProbeBox, Within> box_lists;
  PseudonormalArray pseudonormals;
  PointInstances instances, whole_instances;    // of the two trees
  std::unique_ptr<Buffer<Within>> some_within;  // of a part of points on the device
};

}  // namespace ballot
