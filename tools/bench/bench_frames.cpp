#include "tools/bench/bench_frames.h"

#include <algorithm>
#include <chrono>

#include "tools/bench/markdown.h"

namespace ballot::cli {

namespace {

using Clock = std::chrono::steady_clock;

double ms_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// The figures of a frame, in milliseconds.
struct FrameFigures {
  double pose, tree, ready;  // on the host's clock; ready: uploading what rendering holds of the scene
  FrameTimes device;
  double wall;  // of all of it
  bool refitted;
  double decay;
};

/// What is measured.
struct FrameRun {
  const FramePlan* plan;
  const View* view;
  Query query;
  std::uint32_t width, height;
};

FrameFigures measure_frame(DeviceScene& world, const FrameRun& run, const Frame& frame) {
  const Clock::time_point start = Clock::now();
  world.set_time(run.plan->clip, frame.seconds, run.plan->update);
  const double moved = ms_since(start);
  const DeviceScene::Update update = world.last_update();
  const auto batch = world.make_batch(*run.view, find_ray_kind(kPrimaryRays), run.width, run.height);
  const FrameTimes times = world.frame(*batch, run.query);
  return {.pose = 1e3 * update.pose_s,
          .tree = 1e3 * (update.seconds - update.ready_s),
          .ready = 1e3 * update.ready_s,
          .device = times,
          .wall = moved + times.total_ms(),
          .refitted = update.refitted,
          .decay = world.refit_policy().decay()};
}

/// Returns the median of a figure over the frames that `of` takes, or "-" if there are none.
template <class Take, class Get>
std::string median_of(const std::vector<FrameFigures>& frames, Take take, Get get) {
  std::vector<double> values;
  for (const FrameFigures& f : frames)
    if (take(f)) values.push_back(get(f));
  if (values.empty()) return "-";
  const auto middle = values.begin() + std::ptrdiff_t(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return bench::figure(*middle);
}

std::vector<std::string> row_of(std::string_view mode, const std::vector<FrameFigures>& frames) {
  const auto all = [](const FrameFigures&) { return true; };
  const auto built = std::size_t(std::ranges::count(frames, false, &FrameFigures::refitted));
  double decay = 0, wall = 0;
  for (const FrameFigures& f : frames) {
    decay = std::max(decay, f.decay);
    wall += f.wall;
  }
  return {std::string(mode),
          fmt::format("{} of {}", built, frames.size()),
          median_of(frames, all, [](const FrameFigures& f) { return f.pose; }),
          median_of(
              frames, [](const FrameFigures& f) { return !f.refitted; }, [](const auto& f) { return f.tree; }),
          median_of(
              frames, [](const FrameFigures& f) { return f.refitted; }, [](const auto& f) { return f.tree; }),
          median_of(frames, all, [](const FrameFigures& f) { return f.ready; }),
          median_of(frames, all, [](const FrameFigures& f) { return f.device.generate_ms; }),
          median_of(frames, all, [](const FrameFigures& f) { return f.device.trace_ms; }),
          median_of(frames, all, [](const FrameFigures& f) { return f.device.shade_ms; }),
          bench::figure(wall > 0 ? 1e3 * double(frames.size()) / wall : 0),
          fmt::format("{:.3f}", decay)};
}

void add_records(std::string_view mode, const FramePlan& plan, const std::vector<FrameFigures>& frames,
                 nlohmann::json& json) {
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const FrameFigures& f = frames[i];
    json["records"].push_back({{"update", mode},
                               {"animation", plan.animation},
                               {"frame", plan.frames[i].number},
                               {"time", plan.frames[i].seconds},
                               {"refitted", f.refitted},
                               {"pose_ms", f.pose},
                               {"tree_ms", f.tree},
                               {"ready_ms", f.ready},
                               {"generate_ms", f.device.generate_ms},
                               {"trace_ms", f.device.trace_ms},
                               {"shade_ms", f.device.shade_ms},
                               {"wall_ms", f.wall},
                               {"decay", f.decay}});
  }
}

/// Returns the modes of a comma-separated list.
std::vector<UpdateMode> modes_of(const std::string& list) {
  std::vector<UpdateMode> modes;
  for (const std::string& name : CLI::detail::split(list, ',')) modes.push_back(find_update(name));
  return modes;
}

Query query_of(const RunArgs& run) {
  QueryArgs args;
  if (run.plan.methods != "all") args.method = run.plan.methods;
  args.numeric = run.plan.numeric;
  args.knobs = run.plan.knobs;
  return args.query();
}

}  // namespace

void BenchFrameArgs::add_to(CLI::App& cmd) {
  frames.add_range_to(cmd);
  cmd.add_option("--updates", updates,
                 "comma-separated list of how the tree follows --frames: auto, refit, rebuild [" + updates + "]");
}

int bench_frames(const RunArgs& run, const BenchFrameArgs& args) {
  args.frames.check();
  if (run.scenes.size() != 1)
    fail(Failure::Arguments, "--frames measures one scene; found {}, expected one SCENE", run.scenes.size());
  const std::vector<UpdateMode> modes = modes_of(args.updates);
  const bench::RunOptions options = run.options();
  const Query query = query_of(run);
  SceneArgs scene_args = run.world;
  scene_args.scene = run.scenes[0];
  nlohmann::json json;
  std::optional<bench::Table> table;
  int code = 0;
  for (const UpdateMode mode : modes) {
    FramePlan plan;
    Opened opened = open_scene(scene_args, {query}, [&](Scene& s) {
      if (run.plan.views != "all") find_view(s, run.plan.views);
      plan = plan_frames(args.frames, s, table ? Outside::Silent : Outside::Said);
    });
    DeviceScene& world = *opened.world;
    plan.update = mode;
    const std::uint32_t side = world.device().is_cpu() ? 256 : 1024;
    const View& view = run.plan.views == "all" ? world.scene().views[0] : find_view(world.scene(), run.plan.views);
    const FrameRun frames{&plan, &view, query, options.width ? options.width : side,
                          options.height ? options.height : side};
    if (!table) {
      say("{}: {} triangles, animation {}, view {}, {} x {}, on {}; builder {}\n\n", world.scene().name,
          world.triangle_count(), plan.animation, view.name, frames.width, frames.height, world.device().name,
          builder_of(world.bvh_stats().builder).name);
      table.emplace(std::vector<std::string>{"update", "built", "pose ms", "build ms", "refit ms", "ready ms",
                                             "generate ms", "trace ms", "shade ms", "frames/s", "decay"});
      json = record_header(world, opened.load_s);
      json["kind"] = "frames";
    }
    measure_frame(world, frames, plan.frames[0]);  // compiles the kernels
    std::vector<FrameFigures> figures;
    for (const Frame& frame : plan.frames) figures.push_back(measure_frame(world, frames, frame));
    const std::string_view name = update_name(mode);
    table->row(row_of(name, figures));
    add_records(name, plan, figures, json);
    code = std::max(code, finish(world));
  }
  if (table) say("{}", table->text());
  write_json(run.world.json, json);
  return code;
}

}  // namespace ballot::cli
