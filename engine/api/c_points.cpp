// Queries of points and of all crossings by the C interface.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>

#include "engine/api/arrays.h"
#include "engine/core/parallel.h"

namespace ballot::api {
namespace {

using PointClock = std::chrono::steady_clock;

/// Returns whether a query asks for mode exact.
bool is_exact(const char* numeric) {
  const std::string_view name = numeric ? numeric : kDefaultNumeric;
  if (name != "exact" && name != kDefaultNumeric)
    refuse(fmt::format("numeric is '{}'; expected {} or exact", name, kDefaultNumeric));
  return name == "exact";
}

/// Returns whether signs are those of pseudonormals.
bool is_by_sides(const BallotPointQuery& query) {
  if (query.sign > BALLOT_SIGN_PSEUDONORMAL)
    refuse(fmt::format("sign is {}; expected 0, parity, or 1, pseudonormals", query.sign));
  return query.sign == BALLOT_SIGN_PSEUDONORMAL;
}

/// Returns the ends and the triangle of an edge as text.
std::string edge_text(const FaultyEdge& edge) {
  return fmt::format("from ({}, {}, {}) to ({}, {}, {}) of triangle {}", edge.from.x, edge.from.y, edge.from.z,
                     edge.to.x, edge.to.y, edge.to.z, edge.prim);
}

/// Refuses signs by pseudonormals of a mesh whose triangles are wound against each other.
void need_wound(ballot::DeviceScene& world) {
  const Topology& t = world.topology();
  if (t.consistently_wound()) return;
  refuse(fmt::format(
      "sign by pseudonormals: triangles are wound against each other: at {} of the {} edges both run in the same "
      "direction, such as that {}; turn triangles round (`ballot check` lists such edges), or set assume_closed and "
      "take wrong signs near these",
      t.flipped, t.edges, edge_text(t.first_flipped.front())));
}

/// Refuses the inside test of a mesh with open edges.
void need_closed(ballot::DeviceScene& world) {
  const Topology& t = world.topology();
  if (t.closed()) return;
  const FaultyEdge& edge = t.first_boundary.empty() ? t.first_nonmanifold.front() : t.first_boundary.front();
  refuse(fmt::format(
      "inside test: the mesh is not closed: {} of its {} edges belong to an odd number of triangles, such as that "
      "{}{}; "
      "mend it (`ballot check` lists such edges), take the sign by pseudonormals, or set assume_closed and take wrong "
      "answers near the gaps",
      t.open, t.edges, edge_text(edge),
      t.flat ? fmt::format("; {} triangles without area are left out", t.flat) : std::string()));
}

/// Returns the points as the engine asks for them, whose answers `out` writes. Their walks are shares [begin, end] of
/// the call.
template <class Answer, class Out>
Stream<ProbePoint, Answer> stream_of(const PointArray& points, Out& out, Watch& watch, double begin, double end) {
  Stream<ProbePoint, Answer> stream{.most = points.count()};
  stream.next = [&points](std::uint64_t first, std::span<ProbePoint> room) {
    points.read(first, room);
    return room.size();
  };
  stream.take = [&out](std::uint64_t first, std::span<const Answer> answers) { out.write(first, answers); };
  if (watch)
    stream.progress = [&watch, begin, part = end - begin, count = points.count()](std::uint64_t done) {
      watch(begin + part * (double(done) / double(count)));
    };
  return stream;
}

/// Writes what is asked of the nearest points.
class NearestArrays {
 public:
  /// `by_sides`: the nearest points tell what is inside.
  NearestArrays(const BallotNearest& to, SceneState& scene, std::size_t count, bool by_sides)
      : to_(to),
        hits_(hit_arrays(to), scene, RowOrder(), count),
        any_(to.prims || to.mesh_ids || to.uvs || to.normals),
        by_sides_(by_sides && (to.signed_distances || to.inside)) {}

  bool wants_sides() const { return by_sides_; }
  bool wants_nearest() const { return any_ || to_.distances || to_.points || to_.signed_distances || by_sides_; }
  bool wants_inside() const { return !by_sides_ && (to_.signed_distances || to_.inside); }

  void write(std::uint64_t first, std::span<const Nearest> answers) {
    if (any_) as_hits_.resize(answers.size());
    std::atomic<std::uint64_t> found{0};
    for_chunks(answers.size(), kChunk, [&](std::size_t begin, std::size_t end) {
      std::uint64_t some = 0;
      for (std::size_t i = begin; i < end; ++i) {
        const std::size_t place = std::size_t(first) + i;
        some += answers[i].prim != NO_HIT;
        if (any_) as_hits_[i] = {answers[i].distance, answers[i].prim, answers[i].u, answers[i].v};
        if (to_.distances) to_.distances[place] = answers[i].distance;
        if (to_.signed_distances)
          to_.signed_distances[place] = answers[i].behind ? -answers[i].distance : answers[i].distance;
        if (to_.inside && by_sides_) to_.inside[place] = std::uint8_t(answers[i].behind);
        if (to_.points) std::memcpy(to_.points + 3 * place, &answers[i].at, 3 * sizeof(float));
      }
      found += some;
    });
    found_ += found;
    if (any_) hits_.write(std::size_t(first), as_hits_);
  }
  void write(std::uint64_t first, std::span<const std::uint32_t> inside) {
    for (std::size_t i = 0; i < inside.size(); ++i) {
      const std::size_t place = std::size_t(first) + i;
      if (to_.inside) to_.inside[place] = std::uint8_t(inside[i]);
      if (to_.signed_distances && inside[i]) to_.signed_distances[place] = -to_.signed_distances[place];
    }
  }
  std::uint64_t found() const { return found_; }

 private:
  static BallotHits hit_arrays(const BallotNearest& n) {
    auto hits = BALLOT_INIT(BallotHits);
    hits.prims = n.prims, hits.mesh_ids = n.mesh_ids, hits.uvs = n.uvs, hits.normals = n.normals;
    return hits;
  }

  BallotNearest to_;
  HitArrays hits_;
  bool any_, by_sides_;
  std::vector<Hit> as_hits_;
  std::uint64_t found_ = 0;
};

BallotTimes times_of(PointClock::time_point begin, const TraceTimes& spent, std::uint64_t hits) {
  BallotTimes t = BALLOT_INIT(BallotTimes);
  t.seconds = std::chrono::duration<double>(PointClock::now() - begin).count();
  t.device_ms = spent.device_ms;
  t.hits = hits;
  return t;
}

BallotTimes query_points(SceneState& scene, const PointArray& points, const BallotNearest& to,
                         const BallotPointQuery& query, Watch& watch) {
  const auto begin = PointClock::now();
  ballot::DeviceScene& world = *scene.world;
  NearestArrays out(to, scene, points.count(), is_by_sides(query));
  if (out.wants_inside() && !query.assume_closed) need_closed(world);
  if (out.wants_sides() && !query.assume_closed) need_wound(world);
  const double between = !out.wants_inside() ? 1 : out.wants_nearest() ? 0.5 : 0;
  const PointQuery how{.exact = is_exact(query.numeric), .sides = out.wants_sides()};
  TraceTimes spent;
  if (out.wants_nearest()) spent = world.points().nearest(stream_of<Nearest>(points, out, watch, 0, between), how);
  if (out.wants_inside())
    spent.device_ms += world.points().inside(stream_of<std::uint32_t>(points, out, watch, between, 1), how).device_ms;
  return times_of(begin, spent, out.found());
}

/// Answers points of one array on the device by another.
TraceTimes query_arrays(SceneState& scene, BufferState& points, BufferState& answers, std::uint64_t count,
                        const BallotPointQuery& query) {
  constexpr const char* kCall = "points on the device";
  ballot::DeviceScene& world = *scene.world;
  Buffer<ProbePoint>& from = array_of<ProbePoint>(points, scene, count, kCall, "points");
  PointQuery how{.exact = is_exact(query.numeric), .sides = is_by_sides(query)};
  if (std::holds_alternative<Buffer<Nearest>>(answers.array)) {
    how.sides = false;
    return world.points().nearest(from, array_of<Nearest>(answers, scene, count, kCall, "answers"), count, how);
  }
  const auto check_mesh = [&] {
    if (!query.assume_closed) how.sides ? need_wound(world) : need_closed(world);
  };
  if (std::holds_alternative<Buffer<std::uint32_t>>(answers.array)) {
    Buffer<std::uint32_t>& inside = array_of<std::uint32_t>(answers, scene, count, kCall, "answers");
    check_mesh();
    return world.points().inside(from, inside, count, how);
  }
  Buffer<float>& distances = array_of<float>(answers, scene, count, kCall, "answers");
  check_mesh();
  return world.points().signed_distances(from, distances, count, how);
}

/// A query for crossings, with the memory that it refers to.
class ListQuery {
 public:
  ListQuery(const SceneState& scene, const BallotLists& lists) : ray_masks_(lists.ray_masks) {
    query_.most = lists.most ? lists.most : kAllHits;
    query_.exact = is_exact(lists.numeric);
    if (lists.cull > BALLOT_CULL_FRONT)
      refuse(fmt::format("crossings: cull is {}; expected 0, none, 1, back, or 2, front", lists.cull));
    query_.cull = Cull(lists.cull);
    if (lists.alpha > 1) refuse(fmt::format("crossings: alpha is {}; expected 0 or 1", lists.alpha));
    if (lists.alpha && query_.exact)
      refuse("crossings: alpha is 1 and numeric is 'exact'; expected one of them: textures are read in float32");
    query_.alpha = lists.alpha != 0;
    if (!lists.ray_masks) return;
    const SceneInstances& all = scene.world->scene_facts().instances;
    if (std::ranges::all_of(all.placements, [](const Placement& p) { return p.mask == kMeetsAll; })) return;
    for (const Placement& p : all.placements)
      triangle_masks_.insert(triangle_masks_.end(), all.triangles_of(p.mesh), p.mask);
    query_.triangle_masks = triangle_masks_;
  }
  ListQuery(const ListQuery&) = delete;
  const CrossingQuery& query() const { return query_; }

  /// Returns the rays in an order, with their masks.
  RaySource source(const RayArray& rays, const RowOrder& order, Watch& watch) const {
    RaySource source;
    source.count = rays.count();
    if (watch)
      source.progress = [&watch, count = rays.count()](std::uint64_t done) { watch(double(done) / double(count)); };
    source.read = [&](std::uint64_t first, std::span<Ray> room) { rays.read(order, std::size_t(first), room); };
    if (!ray_masks_) return source;
    source.masks = [this, &order](std::uint64_t first, std::span<std::uint32_t> room) {
      order.for_runs(std::size_t(first), room.size(), [&](std::size_t i, std::size_t place, std::size_t n) {
        std::copy_n(ray_masks_ + place, n, room.begin() + std::ptrdiff_t(i));
      });
    };
    return source;
  }

 private:
  CrossingQuery query_;
  std::vector<std::uint32_t> triangle_masks_;
  const std::uint32_t* ray_masks_;
};

/// Counts crossings. Rays in rows are taken in tiles, as by ballot_trace().
BallotTimes count_crossings(SceneState& scene, const RayArray& rays, const BallotLists& lists) {
  const auto begin = PointClock::now();
  const ListQuery query(scene, lists);
  const RowOrder order = RowOrder::find(rays);
  Watch watch(lists, *scene.device);
  const Watched watched(watch);
  std::atomic<std::uint64_t> hits{0};
  const auto take = [&](std::uint64_t first, std::span<const std::uint32_t> all) {
    for_chunks(all.size(), kChunk, [&](std::size_t from, std::size_t to) {
      const std::span<const std::uint32_t> some = all.subspan(from, to - from);
      hits += std::uint64_t(some.size()) - std::uint64_t(std::ranges::count(some, 0u));
      if (!lists.counts) return;
      order.for_runs(std::size_t(first) + from, some.size(), [&](std::size_t i, std::size_t place, std::size_t n) {
        std::ranges::copy(some.subspan(i, n), lists.counts + place);
      });
    });
  };
  RayQueries& queries = scene.world->rays();
  return times_of(begin, queries.count(query.source(rays, order, watch), take, query.query()), hits);
}

BallotTimes list_crossings(SceneState& scene, const RayArray& rays, const BallotLists& lists) {
  if (!lists.take && lists.most == 0) return count_crossings(scene, rays, lists);
  const auto begin = PointClock::now();
  const ListQuery query(scene, lists);
  const RowOrder in_turn;
  Watch watch(lists, *scene.device);
  const Watched watched(watch);
  std::uint64_t hits = 0;
  const auto take = [&](std::uint64_t first, std::span<const std::uint32_t> counts, std::span<const Hit> found) {
    for (std::size_t i = 0; i < counts.size(); ++i) {
      hits += counts[i] != 0;
      if (lists.counts) lists.counts[first + i] = counts[i];
    }
    if (!lists.take) return;
    const InCallback mark(*scene.device);
    if (lists.take(lists.user, first, counts.size(), counts.data(), reinterpret_cast<const BallotHit*>(found.data())))
      throw Refused(BALLOT_ERROR_INTERRUPTED, fmt::format("interrupted after {} rays", first + counts.size()));
  };
  RayQueries& queries = scene.world->rays();
  return times_of(begin, queries.list(query.source(rays, in_turn, watch), take, query.query()), hits);
}

}  // namespace
}  // namespace ballot::api

using namespace ballot::api;

BallotStatus ballot_query_points(BallotScene* scene, const BallotPoints* points, const BallotNearest* nearest,
                                 const BallotPointQuery* query, BallotTimes* times) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(points, "ballot_query_points", "points");
    need(nearest, "ballot_query_points", "nearest");
    const PointArray array(read_struct(points, "BallotPoints"));
    const BallotNearest to = read_struct(nearest, "BallotNearest");
    const BallotPointQuery q = read_struct(query, "BallotPointQuery");
    Watch watch(q, *state->device, "points");
    const Watched watched(watch);
    const DeviceUse use(*state->device);
    keep_fit(*state);
    write_struct(times, query_points(*state, array, to, q, watch), "BallotTimes");
  });
}

BallotStatus ballot_query_point_buffers(BallotScene* scene, BallotBuffer* points, BallotBuffer* answers, uint64_t count,
                                        const BallotPointQuery* query, BallotTimes* times) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    const auto begin = PointClock::now();
    const auto from = use(points), to = use(answers);
    const BallotPointQuery q = read_struct(query, "BallotPointQuery");
    const DeviceUse device(*state->device);
    keep_fit(*state);
    const Watch watch(q, *state->device, "points");
    const Watched watched(watch);
    write_struct(times, times_of(begin, query_arrays(*state, *from, *to, count, q), 0), "BallotTimes");
  });
}

BallotStatus ballot_list_crossings(BallotScene* scene, const BallotRays* rays, const BallotLists* lists,
                                   BallotTimes* times) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(rays, "ballot_list_crossings", "rays");
    need(lists, "ballot_list_crossings", "lists");
    const RayArray array(read_struct(rays, "BallotRays"));
    const BallotLists l = read_struct(lists, "BallotLists");
    const DeviceUse use(*state->device);
    keep_fit(*state);
    write_struct(times, list_crossings(*state, array, l), "BallotTimes");
  });
}
