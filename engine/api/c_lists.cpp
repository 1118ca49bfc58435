// Lists by the C interface: crossings of rays, and triangles near points or in boxes.
#include <algorithm>
#include <atomic>
#include <string_view>

#include "engine/api/boxes.h"
#include "engine/api/crossings.h"
#include "engine/api/in_double.h"
#include "engine/api/sums.h"
#include "engine/core/parallel.h"

namespace ballot::api {
namespace {

/// A query for crossings of some rays, with the memory that it refers to.
class CrossingCall {
 public:
  CrossingCall(const SceneState& scene, const RayArray& rays, const BallotQuery& query, const RowOrder& order)
      : rays_(rays), order_(order), query_(crossing_query(query, is_double(query))) {
    if (!rays.filters().has(FILTER_MASK)) return;
    triangle_masks_ = masks_of_triangles(scene);
    query_.triangle_masks = triangle_masks_;
  }
  CrossingCall(const CrossingCall&) = delete;
  CrossingQuery& query() { return query_; }

  /// Returns the rays in their order, with their filters.
  RaySource source(Watch& watch, Context& gpu) const {
    RaySource source;
    source.count = rays_.count();
    source.make = rays_.make_there(gpu, order_);
    if (watch)
      source.progress = [&watch, count = rays_.count()](std::uint64_t done) { watch(double(done) / double(count)); };
    source.read = [this](std::uint64_t first, std::span<Ray> room) { rays_.read(order_, std::size_t(first), room); };
    source.filters = rays_.filters().readers(order_);
    return source;
  }

 private:
  const RayArray& rays_;
  const RowOrder& order_;
  CrossingQuery query_;
  std::vector<std::uint32_t> triangle_masks_;
};

/// Writes lists to a caller's arrays, in their order.
class ListArrays {
 public:
  ListArrays(const BallotLists& to, const DeviceState& device, const char* what)
      : to_(to), device_(device), what_(what) {
    if (to_.offsets) to_.offsets[0] = 0;
  }
  void write(std::uint64_t first, std::span<const std::uint32_t> counts, std::span<const Hit> hits) {
    std::atomic<std::uint64_t> found{0};
    for_chunks(counts.size(), kChunk, [&](std::size_t begin, std::size_t end) {
      std::uint64_t some = 0;
      for (std::size_t i = begin; i < end; ++i) some += counts[i] != 0;
      found += some;
      if (to_.counts) std::copy(counts.begin() + begin, counts.begin() + end, to_.counts + first + begin);
    });
    found_ += found;
    for (std::size_t i = 0; to_.offsets && i < counts.size(); ++i) to_.offsets[first + i + 1] = sum_ += counts[i];
    if (!to_.take) return;
    const InCallback mark(device_);
    if (to_.take(to_.user, first, counts.size(), counts.data(), reinterpret_cast<const BallotHit*>(hits.data())))
      throw Refused(BALLOT_ERROR_INTERRUPTED, fmt::format("interrupted after {} {}", first + counts.size(), what_));
  }
  std::uint64_t found() const { return found_; }

 private:
  BallotLists to_;
  const DeviceState& device_;
  const char* what_;
  std::int64_t sum_ = 0;
  std::uint64_t found_ = 0;
};

/// Gives lists of crossings the t of the rays as they were given.
void tell_as_given(const RayArray& rays, std::uint64_t first, std::span<const std::uint32_t> counts,
                   std::span<Hit> hits) {
  for (std::size_t i = 0, at = 0; i < counts.size(); at += counts[i++]) {
    RayInDouble ray;
    double moved;
    rays.read_given(std::size_t(first) + i, {&ray, 1});
    rays.recentring()->ray(ray, moved);
    for (Hit& hit : hits.subspan(at, counts[i])) hit.t = float(double(hit.t) + moved);
  }
}

/// Counts crossings. Rays in rows are taken in tiles, as by ballot_trace().
BallotTimes count_crossings(SceneState& scene, const RayArray& rays, std::int64_t* counts, const BallotQuery& query,
                            Watch& watch) {
  const Clock clock;
  const RowOrder order = RowOrder::find(rays);
  CrossingCall call(scene, rays, query, order);
  std::atomic<std::uint64_t> hits{0};
  const auto take = [&](std::uint64_t first, std::span<const std::uint32_t> all) {
    for_chunks(all.size(), kChunk, [&](std::size_t from, std::size_t to) {
      const std::span<const std::uint32_t> some = all.subspan(from, to - from);
      hits += std::uint64_t(some.size()) - std::uint64_t(std::ranges::count(some, 0u));
      if (!counts) return;
      order.for_runs(std::size_t(first) + from, some.size(), [&](std::size_t i, std::size_t place, std::size_t n) {
        std::ranges::copy(some.subspan(i, n), counts + place);
      });
    });
  };
  if (is_double(query)) {
    const auto counted = [&](std::uint64_t first, std::span<const std::uint32_t> all, std::span<const Hit>) {
      take(first, all);
    };
    return clock.times(list_in_double(scene, rays, order, call.query(), watch, counted), hits);
  }
  return clock.times(scene.world->rays().count(call.source(watch, *scene.device->gpu), take, call.query()), hits);
}

BallotTimes list_crossings(SceneState& scene, const RayArray& rays, const BallotLists& lists, const BallotQuery& query,
                           Watch& watch) {
  if (!lists.take && !lists.offsets && query.first == 0)
    return count_crossings(scene, rays, lists.counts, query, watch);
  const Clock clock;
  const RowOrder in_turn;
  CrossingCall call(scene, rays, query, in_turn);
  ListArrays out(lists, *scene.device, "rays");
  std::vector<Hit> told;
  const auto take = [&](std::uint64_t first, std::span<const std::uint32_t> counts, std::span<const Hit> found) {
    if (rays.recentring() && lists.take) {
      told.assign(found.begin(), found.end());
      tell_as_given(rays, first, counts, told);
      found = told;
    }
    out.write(first, counts, found);
  };
  const TraceTimes spent = is_double(query)
                               ? list_in_double(scene, rays, in_turn, call.query(), watch, take)
                               : scene.world->rays().list(call.source(watch, *scene.device->gpu), take, call.query());
  return clock.times(spent, out.found());
}

/// Returns the triangles of a call as hits, in the memory of `hits`.
std::span<const Hit> as_hits(std::span<const Within> found, std::vector<Hit>& hits) {
  hits.resize(found.size());
  for_chunks(hits.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) hits[i] = {found[i].distance, found[i].prim, 0, 0};
  });
  return hits;
}

/// Lists the triangles near points, or in boxes. `find` asks for them: find(stream, take, query).
template <class Question, class Array, class Find>
BallotTimes list_triangles(SceneState& scene, const Array& array, const char* what, const BallotLists& lists,
                           Stream<Question, std::uint32_t> stream, Watch& watch, const Find& find) {
  const Clock clock;
  ListArrays out(lists, *scene.device, what);
  stream.most = array.count();
  const auto read = [&array](std::uint64_t first, std::span<Question> room) {
    array.read(first, room);
    return room.size();
  };
  const auto tell = [&watch, count = array.count()](std::uint64_t done) { watch(double(done) / double(count)); };
  stream.next = read;
  if (watch) stream.progress = tell;
  std::vector<Hit> hits;
  const auto take = [&](std::uint64_t first, std::span<const std::uint32_t> counts, std::span<const Within> found) {
    out.write(first, counts, as_hits(lists.take ? found : found.first(0), hits));
  };
  const TriangleFilters filters(scene, array.filters());
  const PointQuery query = filters.on(PointQuery());
  const TraceTimes spent = find(stream, take, query);
  return clock.times(spent, out.found());
}

BallotTimes list_within(SceneState& scene, const PointArray& points, const BallotLists& lists, Watch& watch) {
  const InsideStream stream{.make = points.make_there(*scene.device->gpu)};
  return list_triangles(scene, points, "points", lists, stream, watch,
                        [&](const InsideStream& asked, const TakeWithin& take, const PointQuery& how) {
                          return scene.world->points().within(asked, take, how);
                        });
}

BallotTimes list_overlapping(SceneState& scene, const BoxArray& boxes, const BallotLists& lists, Watch& watch) {
  return list_triangles(scene, boxes, "boxes", lists, BoxStream(), watch,
                        [&](const BoxStream& asked, const TakeWithin& take, const PointQuery& how) {
                          return scene.world->points().overlapping(asked, take, how);
                        });
}

}  // namespace

void check_first(const BallotQuery& query) {
  for (const auto& [name, value] : {std::pair{"method", query.method.text}, std::pair{"knobs", query.knobs.text}})
    if (value && std::string_view(value) != kDefaultMethod && *value)
      refuse(fmt::format(
          "{} is '{}', beside first, last, masks, excluded, groups, cull, alpha or strongest, which one method "
          "answers; expected none",
          name, value));
  if (query.any && query.first) refuse("any is 1 and first is set; expected one of them");
  if (query.last && (query.any || query.first))
    refuse(fmt::format("last is set and {}; expected one of them", query.any ? "any is 1" : "first is set"));
  if (query.strongest && (query.any || query.first || query.last))
    refuse(fmt::format("strongest is set and {}; expected one of them", query.any     ? "any is 1"
                                                                        : query.first ? "first is set"
                                                                                      : "last is set"));
  for (const auto& [name, count] : {std::pair{"last", query.last}, std::pair{"strongest", query.strongest}})
    if (count > 16) refuse(fmt::format("{} is {}; expected 1 to 16, or 0 for none", name, count));
  if (!query.strongest != !query.value)
    refuse(fmt::format("{} is set without {}; expected both", query.value ? "value" : "strongest",
                       query.value ? "strongest" : "value"));
}

TraceTimes first_crossings(SceneState& scene, const RayArray& rays, const WantedHits& to, const BallotQuery& query,
                           Watch& watch, std::uint64_t& hits) {
  check_first(query);
  const std::uint32_t most = hits_of_each(query);
  if (rays.count() > kMostBytes / sizeof(Hit) / most)
    refuse(
        fmt::format("{} hits of each of {} rays are asked for; no memory holds as many: expected fewer than 2^47 "
                    "bytes in all",
                    most, rays.count()));
  const RowOrder in_turn;
  CrossingCall call(scene, rays, query, in_turn);
  call.query().any = query.any != 0;
  HitArrays out(to.columns, to.values, scene, in_turn, rays.count() * most, {&rays, most, is_double(query)});
  SumArrays sums(to.columns, scene, rays, in_turn, most);
  const auto take = [&](std::uint64_t first, std::span<const Hit> rows) {
    for (std::size_t i = 0; i < rows.size(); i += most) hits += rows[i].prim != NO_HIT;
    out.write(std::size_t(first) * most, rows);
    sums.add(std::size_t(first) * most, rows);
  };
  const RaySource source = call.source(watch, *scene.device->gpu);
  TraceTimes spent;
  if (query.strongest) {
    if (is_double(query)) refuse("strongest is set and numeric is 'double'; expected watertight or exact");
    spent = strongest_crossings(scene, source, query, call.query(), take);
  } else if (is_double(query)) {
    call.query().most = most;
    spent = first_in_double(scene, rays, call.query(), watch, take);
  } else {
    spent = scene.world->rays().first(source, most, take, call.query());
  }
  out.end(spent);
  sums.end();
  return spent;
}

}  // namespace ballot::api

using namespace ballot::api;

BallotStatus ballot_list_crossings(BallotScene* scene, const BallotRays* rays, const BallotLists* lists,
                                   const BallotQuery* query, BallotTimes* times) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(rays, "ballot_list_crossings", "rays");
    need(lists, "ballot_list_crossings", "lists");
    RayArray array(read_struct(rays, "BallotRays"));
    if (array.weights()) refuse("rays: weight is given; expected none: crossings have no sums");
    const BallotLists l = read_struct(lists, "BallotLists");
    run_call(*state, query, kCrossingsKind, "rays", times, [&](const BallotQuery& q, Watch& watch) {
      array.ask(*state, is_double(q));
      return list_crossings(*state, array, l, q, watch);
    });
  });
}

BallotStatus ballot_list_within(BallotScene* scene, const BallotPoints* points, const BallotLists* lists,
                                const BallotQuery* query, BallotTimes* times) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(points, "ballot_list_within", "points");
    need(lists, "ballot_list_within", "lists");
    PointArray array(read_struct(points, "BallotPoints"), true);
    const BallotLists l = read_struct(lists, "BallotLists");
    run_call(*state, query, kWithinKind, "points", times, [&](const BallotQuery&, Watch& watch) {
      array.ask(*state);
      return list_within(*state, array, l, watch);
    });
  });
}

BallotStatus ballot_list_overlapping(BallotScene* scene, const BallotBoxes* boxes, const BallotLists* lists,
                                     const BallotQuery* query, BallotTimes* times) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(boxes, "ballot_list_overlapping", "boxes");
    need(lists, "ballot_list_overlapping", "lists");
    BoxArray array(read_struct(boxes, "BallotBoxes"));
    const BallotLists l = read_struct(lists, "BallotLists");
    run_call(*state, query, kOverlappingKind, "boxes", times, [&](const BallotQuery&, Watch& watch) {
      array.ask(*state);
      return list_overlapping(*state, array, l, watch);
    });
  });
}
