#include "tools/bench/bench_queries.h"

#include <algorithm>
#include <random>

#include "tools/bench/markdown.h"
#include "tools/bench/plan.h"
#include "tools/hard/hard.h"

namespace ballot::cli {

namespace {

using QueryClock = std::chrono::steady_clock;
constexpr std::string_view kQueries[] = {"count", "list", "first", "nearest", "inside", "side"};
constexpr std::uint32_t kFirst = 4;  // crossings of a ray that "first" asks for
constexpr float kNowhere = std::numeric_limits<float>::infinity();

/// What is measured.
struct QueryRun {
  std::vector<std::string> queries, kinds, modes;
  Query trace;
  std::string view;
  std::uint32_t width, height, repeats;
  RayKindOptions options;
  bool check;
  bool quick = false;    // of hard cases
  bool warms_up = true;  // calls each query once before it is timed

  bool wants(std::string_view query) const { return std::ranges::count(queries, query) > 0; }
  bool wants_crossings() const { return wants("count") || wants("list") || wants("first"); }
  bool wants_points() const { return wants("nearest") || wants("inside") || wants("side"); }
};

/// The figures of one query on one set of rays or points.
struct QueryFigures {
  std::string query, mode, of;
  std::uint64_t count = 0;
  double device_ms = 0, wall_ms = 0;  // medians
  std::optional<QueryErrors> errors;
  double mega_per_s(double ms) const { return ms > 0 ? double(count) / ms * 1e-3 : 0; }
};

/// Calls a query several times. Returns its figures; `last` has the answers of the last call.
template <class Call>
QueryFigures timed(const QueryRun& run, std::string query, std::string mode, std::string of, std::uint64_t count,
                   const Call& call) {
  std::vector<double> device, wall;
  if (run.warms_up) call();  // compiles the kernel, and takes the memory
  for (std::uint32_t i = 0; i < run.repeats; ++i) {
    const auto begin = QueryClock::now();
    device.push_back(call().device_ms);
    wall.push_back(std::chrono::duration<double, std::milli>(QueryClock::now() - begin).count());
  }
  return {.query = std::move(query),
          .mode = std::move(mode),
          .of = std::move(of),
          .count = count,
          .device_ms = bench::quantile(device, 0.5),
          .wall_ms = bench::quantile(wall, 0.5),
          .errors = {}};
}

RaySource source_of(std::span<const Ray> rays) {
  RaySource source;
  source.count = rays.size();
  source.read = [rays](std::uint64_t first, std::span<Ray> room) {
    std::copy_n(rays.begin() + std::ptrdiff_t(first), room.size(), room.begin());
  };
  return source;
}

TraceTimes count_rays(DeviceScene& world, std::span<const Ray> rays, bool exact, std::vector<std::uint32_t>& counts) {
  counts.clear();
  return world.rays().count(source_of(rays),
                            [&](std::uint64_t, std::span<const std::uint32_t> some) {
                              counts.insert(counts.end(), some.begin(), some.end());
                            },
                            {.exact = exact});
}

TraceTimes list_rays(DeviceScene& world, std::span<const Ray> rays, bool exact, std::uint32_t most,
                     ListedCrossings& all) {
  all.counts.clear(), all.hits.clear();
  return world.rays().list(source_of(rays),
                           [&](std::uint64_t, std::span<const std::uint32_t> some, std::span<const Hit> hits) {
                             all.counts.insert(all.counts.end(), some.begin(), some.end());
                             all.hits.insert(all.hits.end(), hits.begin(), hits.end());
                           },
                           {.most = most, .exact = exact});
}

/// Measures the queries of rays in one mode, and judges them if asked to. All are judged beside the lists.
void measure_crossings(DeviceScene& world, const QueryRun& run, const std::string& of, std::span<const Ray> rays,
                       const std::string& mode, std::vector<QueryFigures>& all) {
  const bool exact = mode == "exact";
  RayAnswers answers{.counts = {}, .lists = {}, .first = {}, .most = kFirst};
  const auto measure = [&](const char* query, const auto& call) {
    return timed(run, query, mode, of, rays.size(), call);
  };
  std::optional<QueryFigures> count, list, first;
  if (run.wants("count")) count = measure("count", [&] { return count_rays(world, rays, exact, answers.counts); });
  if (run.wants("list") || run.check)
    list = measure("list", [&] { return list_rays(world, rays, exact, kAllHits, answers.lists); });
  if (run.wants("first"))
    first = measure("first", [&] { return list_rays(world, rays, exact, kFirst, answers.first); });
  if (run.check) {
    const RayErrors errors = QueryJudge(world.tracer().tree()).rays(rays, answers);
    if (count) count->errors = errors.counts;
    if (first) first->errors = errors.first;
    list->errors = errors.lists;
  }
  if (count) all.push_back(*count);
  if (run.wants("list")) all.push_back(*list);
  if (first) all.push_back(*first);
}

/// Measures the queries of rays on those of one kind, beside the nearest hit.
void measure_rays(DeviceScene& world, const QueryRun& run, const std::string& kind, std::vector<QueryFigures>& all) {
  const View& view = run.view == "all" ? world.scene().views[0] : find_view(world.scene(), run.view);
  const auto batch = world.make_batch(view, find_ray_kind(kind), run.width, run.height, run.options);
  if (batch->count() == 0) return;
  const std::vector<Ray> rays = batch->rays();
  const Query query = world.resolve(*batch, run.trace);
  all.push_back(
      timed(run, "nearest hit", run.trace.numeric, kind, rays.size(), [&] { return world.trace(*batch, query); }));
  for (const std::string& mode : run.modes) measure_crossings(world, run, kind, rays, mode, all);
}

/// Returns points of a grid over the bounds and a tenth of their longest side around them, in rows of x; or as many
/// random ones.
std::vector<ProbePoint> points_over(const Bounds& bounds, std::size_t count, bool random) {
  const glm::vec3 sides = bounds.hi - bounds.lo;
  const glm::vec3 room(0.1f * std::max({sides.x, sides.y, sides.z})), lo = bounds.lo - room, size = sides + 2.f * room;
  const auto side = std::uint32_t(std::max(2.0, std::round(std::cbrt(double(count)))));
  std::vector<ProbePoint> points;
  points.reserve(std::size_t(side) * side * side);
  std::mt19937 numbers(1);
  const auto unit = [&] { return float(numbers() >> 8) * 0x1p-24f; };
  for (std::uint32_t z = 0; z < side; ++z)
    for (std::uint32_t y = 0; y < side; ++y)
      for (std::uint32_t x = 0; x < side; ++x) {
        const glm::vec3 at = random ? glm::vec3(unit(), unit(), unit()) : glm::vec3(x, y, z) / float(side - 1);
        points.push_back({lo + at * size, kNowhere});
      }
  return points;
}

/// Returns points that are hard to answer: corners of triangles, middles of edges, points of the inside, and points
/// beside these by a few roundings.
std::vector<ProbePoint> points_on(const DeviceScene& world, std::size_t count) {
  std::vector<ProbePoint> points;
  const std::uint64_t triangles = world.triangle_count();
  if (triangles == 0) return points;
  points.reserve(count + 3);
  std::mt19937 numbers(1);
  while (points.size() < count) {
    const auto [a, b, c] = world.triangle(std::uint32_t(numbers() % triangles));
    const glm::vec3 inside = (a + b + c) / 3.f;
    const float some = 1 + float(int(numbers() % 9) - 4) * 0x1p-23f;
    for (const glm::vec3& at : {a, 0.5f * b + 0.5f * c, inside, inside * some}) points.push_back({at, kNowhere});
  }
  points.resize(count);
  return points;
}

void measure_points(DeviceScene& world, const QueryRun& run, const std::string& of, std::span<const ProbePoint> points,
                    std::vector<QueryFigures>& all) {
  const QueryJudge judge(world.tracer().tree());
  for (const std::string& mode : run.modes) {
    const PointQuery query{.exact = mode == "exact"};
    std::vector<Nearest> near(points.size());
    const auto measure = [&](const char* name, bool sides) {
      all.push_back(timed(run, name, mode, of, points.size(), [&] {
        return world.points().nearest(points, near, {.exact = query.exact, .sides = sides});
      }));
    };
    if (run.wants("nearest")) {
      measure("nearest", false);
      if (run.check) all.back().errors = judge.nearest(points, near);
    }
    if (run.wants("side")) {
      measure("side", true);
      if (run.check) all.back().errors = judge.sides(points, near);
    }
    if (run.wants("inside")) {
      std::vector<std::uint32_t> inside(points.size());
      all.push_back(
          timed(run, "inside", mode, of, points.size(), [&] { return world.points().inside(points, inside, query); }));
      if (run.check) all.back().errors = judge.inside(points, inside);
      // In a mesh with open edges the answer near a gap is arbitrary.
      if (run.check && !world.topology().closed()) all.back().errors->beyond = 0;
    }
  }
}

void print_queries(const std::vector<QueryFigures>& all, bool check) {
  std::vector<std::string> header{"query", "of", "mode", "number", "M/s on the device", "M/s in all"};
  if (check) header.insert(header.end(), {"wrong", "beyond the bound"});
  bench::Table table(header);
  for (const QueryFigures& f : all) {
    std::vector<std::string> row{f.query,
                                 f.of,
                                 f.mode,
                                 std::to_string(f.count),
                                 bench::figure(f.mega_per_s(f.device_ms)),
                                 bench::figure(f.mega_per_s(f.wall_ms))};
    if (check) {
      row.push_back(f.errors ? std::to_string(f.errors->wrong) : "-");
      row.push_back(f.errors ? std::to_string(f.errors->beyond) : "-");
    }
    table.row(row);
  }
  say("{}", table.text());
}

nlohmann::json record_of(const std::string& scene, const QueryFigures& f) {
  nlohmann::json record{{"scene", scene},       {"query", f.query},           {"of", f.of},
                        {"numeric", f.mode},    {"count", f.count},           {"device_ms", f.device_ms},
                        {"wall_ms", f.wall_ms}, {"checked", nlohmann::json()}};
  if (f.errors)
    record["checked"] = f.errors->checked, record["wrong"] = f.errors->wrong, record["beyond"] = f.errors->beyond;
  return record;
}

/// Returns the names of a comma-separated list, of which each must be known; "all": all of them.
std::vector<std::string> names_of(const std::string& list, std::span<const std::string_view> known,
                                  const char* option) {
  if (list == "all") return {known.begin(), known.end()};
  std::vector<std::string> names = CLI::detail::split(list, ',');
  for (const std::string& name : names)
    if (std::ranges::count(known, name) == 0)
      fail(Failure::Arguments, "{} {}: '{}' is none of {}, all", option, list, name, fmt::join(known, ", "));
  return names;
}

QueryRun query_run(const RunArgs& run, const std::string& queries, bool check, const DeviceInfo& device) {
  constexpr std::string_view kModes[] = {kDefaultNumeric, "exact"};
  const bench::RunOptions checked = run.options();
  QueryRun what{.queries = names_of(queries, kQueries, "--queries"),
                .kinds = CLI::detail::split(run.plan.rays, ','),
                .modes = names_of(run.plan.numeric, kModes, "--numeric"),
                .trace = {},
                .view = run.plan.views,
                .width = checked.width,
                .height = checked.height,
                .repeats = checked.repeats,
                .options = checked.kinds,
                .check = check};
  if (run.plan.rays == "all") what.kinds = {"primary", "diffuse"};
  for (const std::string& kind : what.kinds) find_ray_kind(kind);
  if (what.width == 0) what.width = what.height = device.is_cpu() ? 256 : 1024;
  return what;
}

/// Measures the queries on one scene.
std::vector<QueryFigures> measure_scene(DeviceScene& world, const QueryRun& run) {
  std::vector<QueryFigures> all;
  const ProgressBar bar(world.scene().name + ": queries");
  if (run.wants_crossings())
    for (const std::string& kind : run.kinds) measure_rays(world, run, kind, all);
  const std::size_t points = std::size_t(run.width) * run.height;
  for (const bool random : {false, true})
    measure_points(world, run, random ? "random points" : "grid", points_over(world.bvh().bounds, points, random), all);
  measure_points(world, run, "surface", points_on(world, points), all);
  return all;
}

/// Adds the sums of a hard case's figures, one row a mode.
void add_rows(bench::Table& table, std::string_view name, const QueryRun& run, const std::vector<QueryFigures>& all) {
  for (const std::string& mode : run.modes) {
    QueryErrors sum;
    for (const QueryFigures& f : all)
      if (f.mode == mode) sum += *f.errors;
    table.row(
        {std::string(name), mode, std::to_string(sum.checked), std::to_string(sum.wrong), std::to_string(sum.beyond)});
  }
}

/// Judges the queries on the rays and points of the hard cases, and prints what was found of each case and mode.
template <class Note>
void judge_hard_cases(const DeviceSceneOptions& options, QueryRun run, const Note& note) {
  run.repeats = 1;
  run.warms_up = false;
  bench::Table table({"hard case", "mode", "answers", "wrong", "beyond the bound"});
  ProgressBar bar("hard cases: queries");
  std::size_t done = 0;
  const auto judge = [&](std::string_view name, Scene scene, const BuildSettings& build, std::span<const HardRays> rays,
                         std::span<const HardPoints> points) {
    DeviceSceneOptions own = options;
    own.build = build;
    DeviceScene world(std::move(scene), own);
    std::vector<QueryFigures> all;
    if (run.wants_crossings())
      for (const std::string& mode : run.modes)
        for (const HardRays& set : rays) measure_crossings(world, run, set.name, set.rays, mode, all);
    for (const HardPoints& set : points) measure_points(world, run, set.name, set.points, all);
    add_rows(table, name, run, all);
    note(std::string(name), all);
    bar.update(double(++done) / double(hard_cases().size() + hard_point_cases().size()));
  };
  for (const HardCase& hard : hard_cases()) {
    HardScene made = hard.make(run.quick);
    const std::vector<HardPoints> points = hard_points_of(made.scene.triangles, run.quick);
    judge(hard.name, std::move(made.scene), made.build, made.rays, points);
  }
  if (run.wants_points())
    for (const HardPointCase& hard : hard_point_cases()) {
      HardPointScene made = hard.make(run.quick);
      judge(hard.name, std::move(made.scene), {}, {}, made.sets);
    }
  say("{}", table.text());
}

/// The sums of what was judged.
struct JudgedQueries {
  std::map<std::string, QueryErrors> modes;
  std::uint64_t bad = 0;  // beyond its bound, or wrong in mode exact

  void add(const std::string& mode, const QueryErrors& errors) {
    modes[mode] += errors;
    bad += errors.beyond + (mode == "exact" ? errors.wrong : 0);
  }
  std::string text() const {
    std::string all;
    for (const auto& [mode, sum] : modes)
      all += fmt::format("{}: {} answers judged, {} differ from the exact ones, {} by more than their bound\n", mode,
                         sum.checked, sum.wrong, sum.beyond);
    return all;
  }
};

}  // namespace

std::string queries_text() {
  return "measures queries of points and crossings instead of methods: 'all', or some of count,list,first,nearest,\n"
         "inside,side, in the modes of --numeric (watertight, exact): of the rays of --rays, and as many points: on a "
         "grid, "
         "random, and on the surface";
}

int bench_queries(const RunArgs& run, const std::string& queries, const QueryChecks& checks) {
  const auto gpu = DeviceScene::open_device(run.options().world);
  const DeviceInfo& device = gpu->info();
  QueryRun what = query_run(run, queries, checks.exact, device);
  what.quick = checks.quick;
  nlohmann::json json = device_header("queries", device);
  DeviceSceneOptions options = run.options().world;
  options.context = gpu;
  JudgedQueries judged;
  const auto note = [&](const std::string& scene, const std::vector<QueryFigures>& all) {
    for (const QueryFigures& f : all) {
      json["records"].push_back(record_of(scene, f));
      if (f.errors) judged.add(f.mode, *f.errors);
    }
    write_json(run.world.json, json);
  };
  for (const std::string& file : run.scenes) {
    DeviceScene world(load_scene(file, run.world.load_options()), options);
    run.world.files.check_read();
    say("{}: {} triangles, {} x {} rays, on {} ({})\n\n", world.scene().name, world.triangle_count(), what.width,
        what.height, device.name, device.driver);
    const std::vector<QueryFigures> all = measure_scene(world, what);
    print_queries(all, what.check);
    note(world.scene().name, all);
  }
  if (checks.hard) {
    options.use_cache = false;
    judge_hard_cases(options, what, note);
  }
  if (what.check) say("{}", judged.text());
  if (judged.bad > 0) say_aside("ballot: {} answers are beyond their bound, or wrong in mode exact\n", judged.bad);
  if (!gpu->messages().empty()) say_aside("ballot: {} validation messages (above)\n", gpu->messages().size());
  return judged.bad > 0 || !gpu->messages().empty() ? 1 : 0;
}

}  // namespace ballot::cli
