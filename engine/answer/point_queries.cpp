#include "engine/answer/point_queries.h"

#include "engine/answer/host_walk.h"
#include "engine/answer/point_parts.h"
#include "engine/core/interruption.h"
#include "engine/core/stopwatch.h"
#include "engine/oracle/closest.h"
#include "engine/oracle/crossings.h"
#include "engine/oracle/nearest.h"

namespace ballot {

namespace {

constexpr std::size_t kSettled = 256;  // points that a thread settles at a time
// Points that the host answers, and that one thread answers alone. In the way in which kFewRays was measured, 32 points
// took 224 us by the host and 463 by the kernel, 128 points 673 and 838, 512 points 2382 and 2827 at the median and
// 2080 and 1502 at best. Inside tests of 1 point took 6 us and 198, of 512 points 51 and 285.
constexpr std::uint64_t kFewNearest = 1 << 6, kFewInside = 1 << 9;
constexpr std::size_t kPointsAlone = 1 << 3, kInsideAlone = 1 << 6;

void check_room(std::size_t points, std::size_t room) {
  if (points != room) fail(Failure::Arguments, "point query: {} points, but room for {} answers", points, room);
}

/// Returns an exact answer as a record. `sides`: finds whether the point is behind; may be null.
Nearest record_of(const glm::vec3& point, const ExactClosest& found, const OracleScene& scene,
                  const PseudonormalArray* sides) {
  if (found.prim == NO_HIT) return point_queries::NearestQuery::none();
  Nearest n{glm::vec3(found.at), float(found.distance), found.prim, float(found.u), float(found.v), 0};
  if (!sides) return n;
  const Triangle triangle = scene.world_triangle(found.prim);
  const std::uint32_t part = found.part_is_sure ? found.part : exact_part(point, triangle);
  n.behind = exact_behind(point, triangle, part, sides->of(found.prim));
  return n;
}

/// Replaces answers by those of the exact nearest triangles.
void settle_nearest(DeviceTree& tree, std::span<const ProbePoint> points, const FilterWords& words,
                    std::span<Nearest> answers, const PseudonormalArray* sides,
                    std::span<const std::uint32_t> triangle_masks) {
  const FilterJudge judge(tree.forest(), triangle_masks);
  const bool filters =
      !triangle_masks.empty() || std::ranges::any_of(words.of, [](const auto& of) { return !of.empty(); });
  const OracleScene& scene = tree.oracle_scene();
  const ExactClosestPoints oracle(scene);
  const Stopwatch watch(tree.walked_s());
  for_chunks(points.size(), kSettled, [&](std::size_t begin, std::size_t end) {
    check_interruption();
    for (std::size_t i = begin; i < end; ++i) {
      std::pair<std::uint32_t, Triangle> near(answers[i].prim, {});
      if (near.first != NO_HIT) near.second = scene.world_triangle(near.first);
      std::function<bool(std::uint32_t)> keep;
      if (filters) keep = [&, i](std::uint32_t prim) { return judge.keeps(words, i, prim); };
      const auto* known = near.first == NO_HIT ? nullptr : &near;
      const ExactClosest found = oracle.nearest(points[i].at, points[i].limit, known, keep);
      answers[i] = record_of(points[i].at, found, scene, sides);
    }
  });
}

void settle_inside(DeviceTree& tree, std::span<const ProbePoint> points, std::span<std::uint32_t> answers) {
  const ExactCrossings oracle(tree.oracle_scene());
  const Stopwatch watch(tree.walked_s());
  for_chunks(points.size(), kSettled, [&](std::size_t begin, std::size_t end) {
    check_interruption();
    for (std::size_t i = begin; i < end; ++i)
      if (answers[i] == UNSURE) answers[i] = oracle.inside(points[i].at);
  });
}

}  // namespace

PointQueries::Parts::NearestRunner& PointQueries::Parts::nearest(const PointQuery& query, std::uint32_t filters) {
  if (filters && query.sides)
    fail(Failure::Arguments, "closest points: found filters and sides; expected one of them: sides are those of all");
  filters = point_filters.take(scene, filters, query.triangle_masks);
  std::optional<NearestRunner>& runner = closest[{query.sides, filters}];
  const Defines defines{
      {"BALLOT_SIDES", int(query.sides)}, {"BALLOT_FILTERS", int(filters)}, {"BALLOT_BLOCKS", int(blocks)}};
  if (!runner) runner.emplace(gpu, scene, "closest_point", defines, &point_filters, blocks ? &order : nullptr);
  runner->prepare();
  if (query.sides) {
    pseudonormals.update(gpu, scene);
    runner->bind(BIND_PSEUDONORMALS, pseudonormals.device());
  }
  if (scene.forest()) {
    instances.update(gpu, scene, runner->fetch());
    runner->bind(BIND_POINT_INSTANCES, instances.device());
  }
  return *runner;
}

DeviceTree& PointQueries::Parts::whole_tree() {
  if (whole.update()) inside_tests.clear(), lists_by.clear(), cells.forget_tree(), winding_numbers.reset();
  return whole.tree();
}

PointQueries::Parts::InsideRunner& PointQueries::Parts::inside(const PointQuery& query, std::uint64_t points) {
  DeviceTree& tree = whole_tree();
  const bool by_cells = cells.serve(tree, points);
  std::optional<InsideRunner>& runner = inside_tests[{query.exact, by_cells}];
  const Defines defines{{"BALLOT_EXACT", int(query.exact)}, {"BALLOT_LISTED", int(by_cells)}};
  if (!runner) runner.emplace(gpu, tree, "inside", defines, nullptr, nullptr, by_cells ? &cells : nullptr);
  runner->prepare();
  return *runner;
}

point_queries::Runner<point_queries::WindingQuery>& PointQueries::Parts::winding(const PointQuery& query) {
  DeviceTree& tree = whole_tree();
  if (tree.forest() || tree.facts().shapes)
    fail(Failure::Arguments,
         "winding numbers: found a scene of instances or shapes; expected triangles in one tree, as of layout merge");
  if (!(query.beta >= 1)) fail(Failure::Arguments, "beta is {}; expected at least 1, or 0 for 2", query.beta);
  if (query.exact) fail(Failure::Arguments, "winding numbers: found numeric 'exact'; expected watertight");
  if (!winding_numbers) winding_numbers.emplace(gpu, tree, "winding", Defines{});
  winding_numbers->prepare();
  winding_numbers->bind(BIND_NODE_MOMENTS, moments.update(tree, query.beta));
  return *winding_numbers;
}

point_queries::Settle<Nearest> PointQueries::Parts::settle_nearest(const PointQuery& query) {
  if (!query.exact) return {};
  check_takes(find_numeric("exact"), scene.facts().shapes);
  return [this, by = query.sides ? &pseudonormals : nullptr, triangle_masks = query.triangle_masks](
             std::span<const ProbePoint> points, const FilterWords& words, std::span<Nearest> answers) {
    ballot::settle_nearest(scene, points, words, answers, by, triangle_masks);
  };
}

point_queries::Settle<std::uint32_t> PointQueries::Parts::settle_inside(const PointQuery& query) {
  if (!query.exact) return {};
  check_takes(find_numeric("exact"), scene.facts().shapes);
  return [this](std::span<const ProbePoint> points, const FilterWords&, std::span<std::uint32_t> answers) {
    ballot::settle_inside(whole.tree(), points, answers);
  };
}

PointQueries::PointQueries(Context& gpu, DeviceTree& tree, std::optional<bool> blocks)
    : parts_(std::make_unique<Parts>(gpu, tree, blocks.value_or(!gpu.info().is_cpu()))) {}
void PointQueries::set_cells_pay(std::optional<bool> pay) { parts_->cells.set_pay(pay); }
bool PointQueries::has_cells() const { return parts_->cells.are_found(); }
PointQueries::~PointQueries() = default;

TraceTimes PointQueries::nearest(const NearestStream& stream, const PointQuery& query) {
  if (stream.most <= kFewNearest && !query.exact && !query.filters.bits())
    if (const auto walk = HostWalk::over(parts_->gpu, parts_->scene, HostWalk::Of::Points)) {
      std::span<const glm::vec3> sides;
      if (query.sides) sides = parts_->pseudonormals.update(parts_->gpu, parts_->scene).all();
      return answer_here(stream, kPointsAlone, parts_->scene.walked_s(),
                         [&](const ProbePoint& point) { return walk->nearest(point, sides); });
    }
  ask_interruption();
  return parts_->nearest(query, query.filters.bits()).run(stream, parts_->settle_nearest(query), query.filters);
}

TraceTimes PointQueries::nearest(std::span<const ProbePoint> points, std::span<Nearest> answers,
                                 const PointQuery& query) {
  check_room(points.size(), answers.size());
  return nearest(stream_of(points, answers), query);
}

TraceTimes PointQueries::inside(const InsideStream& stream, const PointQuery& query) {
  if (stream.most <= kFewInside && !query.exact)
    if (const auto walk = HostWalk::over(parts_->gpu, parts_->whole_tree(), HostWalk::Of::Points))
      return answer_here(stream, kInsideAlone, parts_->scene.walked_s(),
                         [&](const ProbePoint& point) { return std::uint32_t(walk->inside(point.at)); });
  ask_interruption();
  return parts_->inside(query, stream.most).run(stream, parts_->settle_inside(query));
}

TraceTimes PointQueries::winding(const WindingStream& stream, const PointQuery& query) {
  ask_interruption();
  return parts_->winding(query).run(stream, {});
}

TraceTimes PointQueries::winding(std::span<const ProbePoint> points, std::span<float> answers,
                                 const PointQuery& query) {
  check_room(points.size(), answers.size());
  return winding(stream_of(points, answers), query);
}

TraceTimes PointQueries::inside(std::span<const ProbePoint> points, std::span<std::uint32_t> answers,
                                const PointQuery& query) {
  check_room(points.size(), answers.size());
  return inside(stream_of(points, answers), query);
}

}  // namespace ballot
