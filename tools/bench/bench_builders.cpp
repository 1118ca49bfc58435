#include "tools/bench/bench_builders.h"

#if __has_include(<malloc.h>)
#include <malloc.h>
#endif

#include <algorithm>
#include <fstream>

#include "tools/bench/markdown.h"
#include "tools/bench/plan.h"

namespace ballot::cli {

namespace {

constexpr std::uint32_t kMostBuilds = 5;  // repeats of a build
constexpr double kLongBuild = 10;         // seconds of a build that is not repeated
constexpr std::chrono::milliseconds kWarmUp{500};

/// The figures of one builder on one scene.
struct BuilderFigures {
  std::string_view builder;
  std::vector<double> build_s;
  std::optional<double> peak_mib;  // of the process while the tree was built, above what it had before
  BvhStats stats;
  std::vector<double> mrays_per_s;  // by ray kind
  double median_s() const { return bench::quantile(build_s, 0.5); }
};

/// Returns a figure of /proc/self/status in MiB; nothing where there is none.
std::optional<double> process_mib(std::string_view name) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with(name)) return std::strtod(line.c_str() + name.size() + 1, nullptr) / 1024;
  return {};
}

/// The largest memory of the process since a point in time, above what it had then. Linux alone tells.
class PeakMemory {
 public:
  PeakMemory() {
#ifdef __GLIBC__
    malloc_trim(0);  // what earlier work has freed is not taken for memory in use
#endif
    before_ = process_mib("VmRSS");
    std::ofstream("/proc/self/clear_refs") << "5";  // begins the largest anew
  }
  std::optional<double> mib() const {
    const auto peak = process_mib("VmHWM");
    if (!peak || !before_) return {};
    return std::max(0.0, *peak - *before_);
  }

 private:
  std::optional<double> before_;
};

/// What is measured, on one device.
struct BuilderRun {
  std::shared_ptr<Context> gpu;
  std::vector<std::string> kinds;
  Query query;
  std::string view;
  std::uint32_t width, height, repeats;
  RayKindOptions options;
  BuildSettings settings;
};

/// A tree that was built, and its figures.
struct Built {
  std::unique_ptr<DeviceScene> world;
  BuilderFigures figures;
};

Built build_by(const Scene& scene, const Builder& builder, const BuilderRun& run) {
  Built built{.world = {},
              .figures = {.builder = builder.name, .build_s = {}, .peak_mib = {}, .stats = {}, .mrays_per_s = {}}};
  DeviceSceneOptions options;
  options.context = run.gpu;
  options.build = run.settings;
  options.build.builder = builder.id;
  options.use_cache = false;
  // A builder compiles its kernels and touches its memory for the first time. A long build does not notice.
  const std::uint32_t builds = std::min(run.repeats, kMostBuilds);
  for (std::uint32_t i = 0; i <= builds; ++i) {
    built.world.reset();
    Scene copy = scene;
    const PeakMemory memory;
    built.world = std::make_unique<DeviceScene>(std::move(copy), options);
    if (i == 0) built.figures.peak_mib = memory.mib();
    const double seconds = built.world->start_times().bvh_s;
    if (i > 0 || seconds > kLongBuild) built.figures.build_s.push_back(seconds);
    if (seconds > kLongBuild) break;
  }
  built.figures.stats = built.world->bvh_stats();
  return built;
}

/// Measures the rays of one kind in all trees, in turn.
void trace_kind(std::vector<Built>& trees, const BuilderRun& run, const std::string& kind) {
  std::vector<std::unique_ptr<RayBatch>> batches;
  std::vector<Query> queries;
  std::vector<std::vector<double>> ms(trees.size());
  for (Built& tree : trees) {
    DeviceScene& world = *tree.world;
    const View& view = run.view == "all" ? world.scene().views[0] : find_view(world.scene(), run.view);
    batches.push_back(world.make_batch(view, find_ray_kind(kind), run.width, run.height, run.options));
    queries.push_back(world.resolve(*batches.back(), run.query));
  }
  const auto trace = [&](std::size_t i) { return trees[i].world->trace(*batches[i], queries[i]).device_ms; };
  const auto start = std::chrono::steady_clock::now();
  do {  // compiles the kernels, and has the clocks of a GPU rise
    for (std::size_t i = 0; i < trees.size(); ++i)
      if (batches[i]->count() > 0) trace(i);
  } while (!run.gpu->info().is_cpu() && std::chrono::steady_clock::now() - start < kWarmUp);
  for (std::uint32_t r = 0; r < run.repeats; ++r)
    for (std::size_t i = 0; i < trees.size(); ++i)
      if (batches[i]->count() > 0) ms[i].push_back(trace(i));
  for (std::size_t i = 0; i < trees.size(); ++i)
    trees[i].figures.mrays_per_s.push_back(
        ms[i].empty() ? 0 : double(batches[i]->count()) / bench::quantile(ms[i], 0.5) * 1e-3);
}

/// Builds all trees, then traces in them in turn.
std::vector<BuilderFigures> measure_builders(const Scene& scene, std::span<const Builder* const> builders,
                                             const BuilderRun& run) {
  std::vector<Built> trees;
  ProgressBar bar(scene.name + ": building and tracing");
  const double steps = double(builders.size() + run.kinds.size());
  for (const Builder* builder : builders) {
    bar.update(double(trees.size()) / steps);
    trees.push_back(build_by(scene, *builder, run));
  }
  for (std::size_t k = 0; k < run.kinds.size(); ++k) {
    bar.update(double(trees.size() + k) / steps);
    trace_kind(trees, run, run.kinds[k]);
  }
  std::vector<BuilderFigures> all;
  for (Built& tree : trees) all.push_back(std::move(tree.figures));
  return all;
}

void print_builders(const std::vector<BuilderFigures>& all, const BuilderRun& run) {
  std::vector<std::string> header{"builder", "build ms", "Mtris/s", "peak MiB", "nodes", "SAH cost"};
  for (const std::string& kind : run.kinds) header.push_back(kind + " Mrays/s");
  bench::Table table(header);
  for (const BuilderFigures& f : all) {
    std::vector<std::string> row{std::string(f.builder),
                                 bench::figure(1e3 * f.median_s()),
                                 bench::figure(double(f.stats.triangles) / f.median_s() * 1e-6),
                                 f.peak_mib ? bench::figure(*f.peak_mib) : "-",
                                 std::to_string(f.stats.nodes),
                                 bench::figure(f.stats.sah)};
    for (const double v : f.mrays_per_s) row.push_back(v > 0 ? bench::figure(v) : "-");
    table.row(row);
  }
  say("{}", table.text());
}

void add_builder_records(const std::string& scene, const std::vector<BuilderFigures>& all, const BuilderRun& run,
                         nlohmann::json& json) {
  for (const BuilderFigures& f : all) {
    nlohmann::json record{{"scene", scene},
                          {"triangles", f.stats.triangles},
                          {"builder", f.builder},
                          {"build_s", f.build_s},
                          {"peak_mib", f.peak_mib ? nlohmann::json(*f.peak_mib) : nlohmann::json()},
                          {"nodes", f.stats.nodes},
                          {"sah", f.stats.sah}};
    for (std::size_t k = 0; k < run.kinds.size(); ++k) record["mrays_per_s"][run.kinds[k]] = f.mrays_per_s[k];
    json["records"].push_back(std::move(record));
  }
}

std::vector<const Builder*> builders_of(const std::string& list, const DeviceInfo& device) {
  std::vector<const Builder*> all;
  for (const std::string& name : CLI::detail::split(list, ','))
    for (const Builder& b : kBuilders) {
      if (b.id == BuilderId::Auto || (name != "all" && find_builder(name).id != b.id)) continue;
      if (name == "all" && b.on_device && !DeviceBuilder::runs_on(device)) continue;
      all.push_back(&b);
    }
  if (all.empty()) fail(Failure::Arguments, "--builders {}: expected names of builders other than auto, or all", list);
  return all;
}

BuilderRun builder_run(const RunArgs& run) {
  const bench::RunOptions checked = run.options();
  QueryArgs query;
  if (run.plan.methods != "all") query.method = run.plan.methods;
  query.numeric = run.plan.numeric;
  query.knobs = run.plan.knobs;
  BuilderRun what{.gpu = {},
                  .kinds = CLI::detail::split(run.plan.rays, ','),
                  .query = query.query(),
                  .view = run.plan.views,
                  .width = checked.width,
                  .height = checked.height,
                  .repeats = checked.repeats,
                  .options = checked.kinds,
                  .settings = checked.world.build};
  if (run.plan.rays == "all") {
    what.kinds.clear();
    for (const RayKind& kind : kRayKinds) what.kinds.emplace_back(kind.name);
  }
  for (const std::string& kind : what.kinds) find_ray_kind(kind);
  ContextOptions options;
  options.device = run.world.device;
  options.validate = run.world.validate;
  what.gpu = std::make_shared<Context>(options);
  if (what.width == 0) what.width = what.height = what.gpu->info().is_cpu() ? 256 : 1024;
  return what;
}

}  // namespace

std::string builders_text() {
  return "measures builders of trees instead of methods: comma-separated names, or 'all'. For each scene a table of\n"
         "time, memory, cost and traced speed by --rays";
}

int bench_builders(const RunArgs& run, const std::string& list) {
  const BuilderRun what = builder_run(run);
  const DeviceInfo& device = what.gpu->info();
  const std::vector<const Builder*> builders = builders_of(list, device);
  nlohmann::json json = device_header("builders", device);
  for (const std::string& file : run.scenes) {
    const Scene scene = load_scene(file, {.allow_outside = run.world.allow_outside});
    run.world.files.check_read();
    say("{}: {} triangles, {} x {} rays by {} in mode {}, on {} ({})\n\n", scene.name, scene.triangles.size(),
        what.width, what.height, what.query.method, what.query.numeric, device.name, device.driver);
    const std::vector<BuilderFigures> all = measure_builders(scene, builders, what);
    print_builders(all, what);
    add_builder_records(scene.name, all, what, json);
    write_json(run.world.json, json);
  }
  if (what.gpu->messages().empty()) return 0;
  say_aside("ballot: {} validation messages (above)\n", what.gpu->messages().size());
  return 1;
}

}  // namespace ballot::cli
