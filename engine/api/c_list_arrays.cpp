// Lists and first crossings of arrays on the device by the C interface.
#include <algorithm>

#include "engine/api/crossings.h"
#include "engine/api/filters_there.h"

namespace ballot::api {
namespace {

/// Where the lists of a call go.
class ListsTo {
 public:
  ListsTo(SceneState& scene, const BallotListBuffers& to, const BufferState& asked, std::uint64_t count,
          const char* call) {
    counts_ = array<std::uint32_t>(scene, to.counts, asked, count, call, "counts");
    offsets_ = array<std::int64_t>(scene, to.offsets, asked, count + 1, call, "offsets");
    hits_ = array<Hit>(scene, to.hits, asked, 0, call, "hits");
    if (counts_) return;
    if (!offsets_ && !hits_) refuse(fmt::format("{}: no output; expected some of counts, offsets, hits", call));
  }
  /// The device's mutex is held.
  DeviceLists<Hit> lists(Context& gpu, std::uint64_t count) {
    if (!counts_) counts_ = &own_.emplace(gpu, std::size_t(count), Access::Storage, "counts of lists");
    return {*counts_, offsets_, hits_};
  }

 private:
  template <class T>
  Buffer<T>* array(SceneState& scene, BallotBuffer* buffer, const BufferState& asked, std::uint64_t count,
                   const char* call, const char* what) {
    if (!buffer) return nullptr;
    states_.push_back(use(buffer));
    if (states_.back().get() == &asked) refuse(fmt::format("{}: the array of {} is what is asked", call, what));
    return &array_of<T>(*states_.back(), scene, count, call, what);
  }

  std::vector<std::shared_ptr<BufferState>> states_;
  Buffer<std::uint32_t>* counts_ = nullptr;
  Buffer<std::int64_t>* offsets_ = nullptr;
  Buffer<Hit>* hits_ = nullptr;
  std::optional<Buffer<std::uint32_t>> own_;
};

constexpr const char* kLists = "lists on the device";

DeviceListed list_rays(SceneState& scene, BufferState& asked, std::uint64_t count, const DeviceLists<Hit>& to,
                       const BallotQuery& query) {
  const auto& rays = array_of<Ray>(asked, scene, count, kLists, "rays");
  const FiltersThere filters(scene, query, count, kLists);
  CrossingQuery how = crossing_query(query);
  how.triangle_masks = filters.of_triangles();
  return scene.world->rays().list({rays, count, filters.words()}, to, how);
}

DeviceListed list_points(SceneState& scene, BufferState& asked, std::uint64_t count, const DeviceLists<Hit>& to,
                         const BallotQuery& query) {
  const auto& points = array_of<ProbePoint>(asked, scene, count, kLists, "points");
  const FiltersThere filters(scene, query, count, kLists);
  PointQuery how;
  how.triangle_masks = filters.of_triangles();
  return scene.world->points().within({points, count, filters.words()}, to, how);
}

}  // namespace

TraceTimes first_crossings(SceneState& scene, const Buffer<Ray>& rays, std::uint64_t count, const BallotQuery& query,
                           Buffer<Hit>& hits) {
  check_first(query);
  const FiltersThere filters(scene, query, count, "trace of arrays on the device");
  CrossingQuery how = crossing_query(query);
  how.any = query.any != 0;
  how.triangle_masks = filters.of_triangles();
  if (query.strongest) {
    const RaySource source{
        .count = count,
        .read = [&](std::uint64_t first, std::span<Ray> room) { rays.download(room, std::size_t(first)); },
        .filters = filters.words().readers()};
    return strongest_crossings(scene, source, query, how, [&](std::uint64_t first, std::span<const Hit> rows) {
      hits.upload(rows, std::size_t(first) * query.strongest);
    });
  }
  return scene.world->rays().first({rays, count, filters.words()}, hits_of_each(query), hits, how);
}

}  // namespace ballot::api

using namespace ballot::api;

BallotStatus ballot_list_buffers(BallotScene* scene, BallotBuffer* questions, uint64_t count,
                                 const BallotListBuffers* lists, const BallotQuery* query, uint64_t* total,
                                 BallotTimes* times) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(lists, "ballot_list_buffers", "lists");
    const BallotListBuffers given = read_struct(lists, "BallotListBuffers");
    const auto asked = use(questions);
    const bool near = std::holds_alternative<ballot::Buffer<ballot::ProbePoint>>(asked->array);
    ListsTo to(*state, given, *asked, count, kLists);
    std::uint64_t all = 0, room = 0;
    run_call(*state, query, near ? kWithinArraysKind : kCrossingArraysKind, near ? "points" : "rays", times,
             [&](const BallotQuery& q, Watch&) {
               const Clock clock;
               const auto there = to.lists(*state->device->gpu, count);
               const ballot::DeviceListed found =
                   near ? list_points(*state, *asked, count, there, q) : list_rays(*state, *asked, count, there, q);
               all = found.records, room = there.records ? there.records->size() : all;
               return clock.times(found.times, 0);
             });
    if (total) *total = all;
    if (all > room)
      refuse(fmt::format("{}: the buffer of hits has {} records; the lists have {}: ask for their number first", kLists,
                         room, all));
  });
}

BallotStatus ballot_compact_hits(BallotScene* scene, BallotBuffer* hits, uint64_t count, uint32_t first,
                                 BallotBuffer* alone, BallotBuffer* rays, uint64_t* found) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(found, "ballot_compact_hits", "found");
    constexpr const char* kCall = "hits alone";
    const auto from = use(hits), to = use(alone), numbers = use(rays);
    if (from == to) refuse(fmt::format("{}: one array is given for all hits and for those alone", kCall));
    const auto& all = array_of<ballot::Hit>(*from, *state, count, kCall, "hits");
    auto& some = array_of<ballot::Hit>(*to, *state, count, kCall, "hits alone");
    auto& of_rays = array_of<std::uint32_t>(*numbers, *state, count, kCall, "rays");
    const DeviceUse device(*state->device);
    *found = state->world->rays().hits_alone(all, count, std::max(first, 1u), some, of_rays).records;
  });
}
