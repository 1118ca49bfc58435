// Queries of points by the C interface.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "engine/api/arrays.h"
#include "engine/api/filters_there.h"
#include "engine/api/in_double.h"
#include "engine/api/outputs.h"
#include "engine/core/interruption.h"
#include "engine/core/parallel.h"
#include "engine/gpu/room.h"
#include "engine/model/hit_geometry.h"

namespace ballot::api {
namespace {

constexpr std::uint64_t kPart = 1 << 22;  // points on the device that are answered at a time, a multiple of 4
constexpr float kInsideWinding = 0.5f;    // points with more are inside
constexpr std::size_t kUntold = 1 << 10;  // points of a call that tells its progress at the end alone

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
  if (world.features().tree.shapes >> SHAPE_DISC & 1)
    refuse("inside test: the scene has discs, which have no inside; set assume_closed to leave them out");
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
Stream<ProbePoint, Answer> stream_of(const PointArray& points, const MakeQuestions<ProbePoint>& make, Out& out,
                                     Watch& watch, double begin, double end) {
  Stream<ProbePoint, Answer> stream{.most = points.count(), .make = make};
  stream.next = [&points](std::uint64_t first, std::span<ProbePoint> room) {
    points.read(first, room);
    return room.size();
  };
  stream.take = [&out](std::uint64_t first, std::span<const Answer> answers) { out.write(first, answers); };
  if (watch && (end == 1 || points.count() > kUntold))
    stream.progress = [&watch, begin, part = end - begin, count = points.count()](std::uint64_t done) {
      watch(begin + part * (double(done) / double(count)));
    };
  return stream;
}

static_assert(sizeof(BallotNearestPoint) == sizeof(Nearest));

bool is_signed(const BallotNearest& to) { return to.signed_distances || to.signed_distances_double; }

/// Writes what is asked of the nearest points.
class NearestArrays {
 public:
  /// `by_sides`: the nearest points tell what is inside.
  /// `by_winding`: winding numbers do. `in_double`: they are found in numeric mode double.
  NearestArrays(const BallotNearest& to, SceneState& scene, const PointArray& points, bool by_sides, bool by_winding,
                bool in_double)
      : to_(to),
        scene_(scene),
        points_(points),
        hits_(hit_arrays(to), read_values(to, "nearest"), scene, RowOrder(), points.count(), {}),
        any_(to.prims || to.mesh_ids || to.uvs || to.normals || to.materials || to.colors || to.shading_normals ||
             to.value_count),
        by_sides_(by_sides && (is_signed(to) || to.inside)),
        by_winding_(by_winding && (is_signed(to) || to.inside)),
        in_double_(in_double) {
    if (wants_doubles()) scene.world->scene();  // here, before several threads ask
  }

  bool wants_sides() const { return by_sides_; }
  bool wants_nearest() const {
    return any_ || to_.nearest || to_.distances || to_.points || is_signed(to_) || by_sides_ || wants_doubles();
  }
  bool wants_inside() const { return !by_sides_ && !by_winding_ && (is_signed(to_) || to_.inside); }
  bool wants_winding() const { return by_winding_ || to_.windings; }

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
        Nearest nearest = answers[i];
        if (nearest.prim != NO_HIT && points_.origin() != glm::dvec3(0))
          nearest.at = glm::vec3(glm::dvec3(nearest.at) + points_.origin());
        if (to_.nearest) std::memcpy(to_.nearest + place, &nearest, sizeof(Nearest));
        if (to_.points) std::memcpy(to_.points + 3 * place, &nearest.at, 3 * sizeof(float));
      }
      if (wants_doubles()) write_doubles(first + begin, answers.subspan(begin, end - begin));
      found += some;
    });
    found_ += found;
    if (any_) hits_.write(std::size_t(first), as_hits_);
  }
  void write(std::uint64_t first, std::span<const std::uint32_t> inside) {
    for (std::size_t i = 0; i < inside.size(); ++i) write_inside(std::size_t(first) + i, inside[i] != 0);
  }
  void write(std::uint64_t first, std::span<const float> windings) {
    for (std::size_t i = 0; i < windings.size(); ++i) {
      if (to_.windings) to_.windings[std::size_t(first) + i] = windings[i];
      if (by_winding_) write_inside(std::size_t(first) + i, windings[i] > kInsideWinding);
    }
  }
  std::uint64_t found() const { return found_; }
  /// Writes what the device makes of all answers, and adds what that takes.
  void end(TraceTimes& times) { hits_.end(times); }

 private:
  bool wants_doubles() const { return to_.distances_double || to_.signed_distances_double || to_.points_double; }
  static BallotHits hit_arrays(const BallotNearest& n) {
    auto hits = BALLOT_INIT(BallotHits);
    hits.prims = n.prims, hits.mesh_ids = n.mesh_ids, hits.uvs = n.uvs, hits.normals = n.normals;
    hits.materials = n.materials, hits.colors = n.colors, hits.shading_normals = n.shading_normals;
    return hits;
  }

  void write_inside(std::size_t place, bool inside) {
    if (to_.inside) to_.inside[place] = std::uint8_t(inside);
    if (to_.signed_distances && inside) to_.signed_distances[place] = -to_.signed_distances[place];
    if (to_.signed_distances_double && inside) to_.signed_distances_double[place] = -to_.signed_distances_double[place];
  }

  void write_doubles(std::uint64_t first, std::span<const Nearest> answers) const {
    std::vector<glm::dvec3> asked(answers.size());
    points_.read_given(first, asked);
    for (std::size_t i = 0; i < answers.size(); ++i) {
      const Nearest& nearest = answers[i];
      glm::dvec3 at(0);
      double distance = std::numeric_limits<double>::infinity();
      if (nearest.prim != NO_HIT) {
        at = glm::dvec3(nearest.at), distance = double(nearest.distance);
        if (!scene_.world->shape_normal({0, nearest.prim, nearest.u, nearest.v})) {
          at = in_double_ ? position_of(corners_of(scene_, nearest.prim), nearest.u, nearest.v)
                          : position_of(scene_.world->triangle(nearest.prim), nearest.u, nearest.v);
          distance = glm::length(asked[i] - points_.origin() - at);
        }
        at += points_.origin();
      }
      if (to_.distances_double) to_.distances_double[first + i] = distance;
      if (to_.signed_distances_double) to_.signed_distances_double[first + i] = nearest.behind ? -distance : distance;
      if (to_.points_double) std::memcpy(to_.points_double + 3 * (first + i), &at, sizeof at);
    }
  }

  BallotNearest to_;
  const SceneState& scene_;
  const PointArray& points_;
  HitArrays hits_;
  bool any_, by_sides_, by_winding_, in_double_;
  std::vector<Hit> as_hits_;
  std::uint64_t found_ = 0;
};

[[noreturn]] void refuse_filter(const char* what) {
  refuse(
      fmt::format("points: found {} beside signed_distances, inside or windings, which are told of the whole scene; "
                  "expected one of them: ask for distances",
                  what));
}

BallotTimes query_points(SceneState& scene, const PointArray& points, const BallotNearest& to, const BallotQuery& query,
                         Watch& watch) {
  const Clock clock;
  ballot::DeviceScene& world = *scene.world;
  const bool as_double = is_double(query), by_winding = decides_by_winding(query);
  PointQuery how = point_query(query, as_double);
  if (as_double && (how.sides || by_winding || to.windings))
    refuse(
        fmt::format("sign is '{}' and numeric is 'double'; expected parity", how.sides ? "pseudonormal" : "winding"));
  NearestArrays out(to, scene, points, how.sides, by_winding, as_double);
  const bool signs = is_signed(to) || to.inside || to.windings;
  for (const auto& [filter, name] :
       {std::pair{FILTER_MASK, "mask"}, {FILTER_EXCLUDED, "excluded"}, {FILTER_GROUP, "group"}})
    if (signs && points.filters().has(std::size_t(filter))) refuse_filter(name);
  if (out.wants_inside() && !query.assume_closed) need_closed(world);
  if (out.wants_sides() && !query.assume_closed) need_wound(world);
  const double between = !out.wants_inside() && !out.wants_winding() ? 1 : out.wants_nearest() ? 0.5 : 0;
  how.sides = out.wants_sides();
  const MakeQuestions<ProbePoint> make = points.make_there(*scene.device->gpu);
  TraceTimes spent;
  const auto take = [&out](std::uint64_t first, auto answers) { out.write(first, answers); };
  if (as_double) {
    if (out.wants_nearest()) spent = nearest_in_double(scene, points, watch, take);
    if (out.wants_inside()) inside_in_double(scene, points, watch, take);
    out.end(spent);
    return clock.times(spent, out.found());
  }
  if (out.wants_nearest())
    spent = world.points().nearest(stream_of<Nearest>(points, make, out, watch, 0, between),
                                   TriangleFilters(scene, points.filters()).on(how));
  if (out.wants_inside())
    spent.device_ms +=
        world.points().inside(stream_of<std::uint32_t>(points, make, out, watch, between, 1), how).device_ms;
  if (out.wants_winding())
    spent.device_ms += world.points().winding(stream_of<float>(points, make, out, watch, between, 1), how).device_ms;
  out.end(spent);
  return clock.times(spent, out.found());
}

constexpr std::initializer_list<std::uint32_t> kOfSides{COLUMN_SIGNED, COLUMN_FLAGS, COLUMN_FLAG_WORDS};
constexpr std::initializer_list<std::uint32_t> kOfNearest{
    COLUMN_DISTANCES, COLUMN_PRIMS,  COLUMN_IDS,       COLUMN_UVS,    COLUMN_NORMALS,
    COLUMN_POINTS,    COLUMN_SIGNED, COLUMN_MATERIALS, COLUMN_COLORS, COLUMN_SHADING_NORMALS};

/// Finds winding numbers of a part of points on the device. Writes to `inside`, unless it is null, what they decide.
void wind(SceneState& scene, const DevicePoints& part, Buffer<float>& windings, Buffer<std::uint32_t>* inside,
          const PointQuery& how, TraceTimes& times) {
  times.device_ms += scene.world->points().winding(part, windings, how).device_ms;
  if (!inside) return;
  std::vector<float> numbers(part.count);
  windings.download(numbers);
  std::vector<std::uint32_t> words(part.count);
  std::ranges::transform(numbers, words.begin(), [](float w) { return std::uint32_t(w > kInsideWinding); });
  inside->upload(words);
}

/// Answers points of an array on the device, part by part, so that what lies between kernels takes a bounded memory.
TraceTimes query_arrays(SceneState& scene, const DevicePoints& points, const Outputs& outputs, PointQuery how,
                        bool by_winding) {
  const std::uint64_t count = points.count;
  PointQueries& queries = scene.world->points();
  const bool signs = outputs.to.any_of(kOfSides), inside = signs && !how.sides;
  const bool winds = outputs.windings || (inside && by_winding);
  const bool near = outputs.nearest || how.sides || !outputs.to.values.empty() || outputs.to.any_of(kOfNearest);
  how.sides = how.sides && signs;
  if (outputs.nearest && outputs.arrays.size() == 1) return queries.nearest(points, *outputs.nearest, how);
  Context& gpu = *scene.device->gpu;
  AnswersThere& there = answers_there(scene);
  const auto size = std::size_t(std::min(count, kPart));
  Buffer<ProbePoint>& asked = buffer_for(there.points, gpu, size, "points of a part");
  DeviceFilters words;
  Buffer<Nearest>& found = buffer_for(there.nearest, gpu, near ? size : 0, "nearest points of a part");
  Buffer<std::uint32_t>& within = buffer_for(there.inside, gpu, inside ? size : 0, "inside tests of a part");
  Buffer<float>& windings = buffer_for(there.windings, gpu, winds ? size : 0, "winding numbers of a part");
  TraceTimes times;
  const PassScope scope(gpu);
  for (std::uint64_t first = 0; first < count; first += kPart) {
    const std::uint64_t some = std::min(kPart, count - first);
    asked.copy_from(points.points, std::size_t(first), 0, std::size_t(some));
    for (std::size_t f = 0; f < FILTERS; ++f) {
      if (!points.filters.of[f]) continue;
      Buffer<std::uint32_t>& of_part = buffer_for(there.words[f], gpu, size, "words of a part");
      of_part.copy_from(*points.filters.of[f], std::size_t(first), 0, std::size_t(some));
      words.of[f] = &of_part;
    }
    const DevicePoints part{asked, some, words};
    if (near) times.device_ms += queries.nearest(part, found, how).device_ms;
    if (winds) wind(scene, part, windings, inside && by_winding ? &within : nullptr, how, times);
    if (inside && !by_winding) times.device_ms += queries.inside(part, within, {.exact = how.exact}).device_ms;
    if (outputs.windings) outputs.windings->copy_from(windings, 0, std::size_t(first), std::size_t(some));
    if (outputs.nearest) outputs.nearest->copy_from(found, 0, std::size_t(first), std::size_t(some));
    record_columns(scene, {found, true, inside ? &within : nullptr, some, first}, outputs.to,
                   [&times](double ms) { times.device_ms += ms; });
    gpu.flush();
    check_interruption();
  }
  gpu.finish();
  return times;
}

}  // namespace
}  // namespace ballot::api

using namespace ballot::api;

BallotStatus ballot_query_points(BallotScene* scene, const BallotPoints* points, const BallotNearest* nearest,
                                 const BallotQuery* query, BallotTimes* times) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    need(points, "ballot_query_points", "points");
    need(nearest, "ballot_query_points", "nearest");
    PointArray array(read_struct(points, "BallotPoints"));
    const BallotNearest to = read_struct(nearest, "BallotNearest");
    run_call(*state, query, kPointsKind, "points", times, [&](const BallotQuery& q, Watch& watch) {
      array.ask(*state);
      return query_points(*state, array, to, q, watch);
    });
  });
}

BallotStatus ballot_query_point_buffers(BallotScene* scene, BallotBuffer* points, uint64_t count,
                                        const BallotOutput* outputs, size_t output_count, const BallotQuery* query,
                                        BallotTimes* times) {
  return guarded_use(scene, [&](const std::shared_ptr<SceneState>& state) {
    constexpr const char* kCall = "points on the device";
    const Clock clock;
    if (output_count) need(outputs, "ballot_query_point_buffers", "outputs");
    const auto from = use(points);
    const auto& in = array_of<ballot::ProbePoint>(*from, *state, count, kCall, "points");
    const Outputs to({outputs, output_count}, ballot::door::kNearestRows, *state, *from, count, kCall);
    const BallotQuery q = read_query(query, kPointArraysKind);
    ballot::PointQuery how = point_query(q);
    const bool signs = to.to.any_of(kOfSides) || to.windings, by_winding = decides_by_winding(q);
    for (std::size_t f = 0; f < FILTERS; ++f)
      if (const FilterArray array = filter_array(q, f); array.words && signs) refuse_filter(array.name);
    const DeviceUse device(*state->device);
    to.check_held(*state);
    keep_fit(*state);
    const Watch watch(q, *state->device, "points");
    const Watched watched(watch);
    if (to.to.any_of(kOfSides) && !by_winding && !q.assume_closed)
      how.sides ? need_wound(*state->world) : need_closed(*state->world);
    const FiltersThere filters(*state, q, count, kCall);
    how.triangle_masks = filters.of_triangles();
    write_struct(times, clock.times(query_arrays(*state, {in, count, filters.words()}, to, how, by_winding), 0),
                 "BallotTimes");
  });
}
