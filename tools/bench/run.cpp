#include "tools/bench/run.h"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <set>

#include "tools/bench/arrange.h"
#include "tools/bench/interrupt.h"
#include "tools/bench/markdown.h"
#include "tools/bench/measure.h"

namespace ballot::bench {

namespace {

using Clock = std::chrono::steady_clock;

std::vector<const View*> chosen_views(const Scene& scene, const Plan& plan) {
  std::vector<const View*> views;
  for (const std::string& name : plan.views) views.push_back(&find_view(scene, name));
  if (plan.views.empty())
    for (const View& view : scene.views) views.push_back(&view);
  return views;
}

/// All entries on one scene and ray kind, the fastest marked.
void print_block(const Block& block) {
  double best = 0;
  for (const Cell& cell : block.cells) best = std::max(best, cell.mrays_per_s());
  Table table({fmt::format("{}, {}, {}", block.scene, block.rays, block.cells.front().first().numeric), "Mrays/s", "ms",
               "FPS", "of best"});
  for (const Cell& cell : block.cells) {
    double ms = 0;
    for (const auto& [view, record] : cell.views) ms += record->trace.median;
    const double speed = cell.mrays_per_s();
    table.row({cell.label + (cell.role == Role::Best
                                 ? fmt::format(" {}={:g}", cell.first().threshold->knob, cell.first().threshold->value)
                                 : ""),
               figure(speed), figure(ms), cell.fps() ? figure(*cell.fps()) : "",
               fmt::format("{:.0f} %{}", 100 * speed / best, speed == best ? " *" : "")});
  }
  fmt::print("{}", table.text());
  std::fflush(stdout);
}

void print_records(const Document& document, std::vector<Record> records) {
  Document part = document;
  part.scenes.clear();
  part.records = std::move(records);
  const std::vector<Document> documents{std::move(part)};
  for (const Setting& setting : arrange(documents).settings)
    for (const Block& block : setting.blocks)
      if (!block.cells.empty()) print_block(block);
}

std::string utc_now() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  ::gmtime_r(&now, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts);
  return text;
}

Document header(const DeviceInfo& device, const Plan& plan, const RunOptions& options) {
  Document d;
  d.device = device.name;
  d.driver = device.driver;
  d.subgroup_size = device.subgroup_size;
  d.commit = commit();
  d.command = options.command;
  d.clock = device.timestamp_bits > 0 && device.timestamp_ns > 0 ? "GPU timestamps" : "wall";
  d.date = utc_now();
  d.size = {options.width, options.height};
  d.repeats = options.repeats;
  d.sweep_repeats = sweep_repeats(plan, options);
  return d;
}

class Run {
 public:
  Run(const Plan& plan, const RunOptions& options, const std::vector<LoadedScene>& scenes)
      : plan_(plan), options_(options), bar_("measuring") {
    for (const LoadedScene& loaded : scenes)
      for (const RaySet& rays : plan.rays)
        total_ +=
            steps_of(plan, rays, options, rays.kind ? chosen_views(loaded.scene, plan).size() : rays.files.size());
  }

  /// One scene, from its device to its tables.
  void add(LoadedScene loaded) {
    const double load_s = loaded.load_s;
    Engine engine(std::move(loaded.scene), options_.engine);
    if (result_.document.device.empty()) begin(engine);
    result_.document.scenes.push_back({engine.scene().name, engine.bvh().stats, load_s});
    const Surroundings around{engine, options_, [this] { step(); }, [this] { bar_.hide(); }};
    for (const RaySet& rays : plan_.rays) {
      Measured measured = measure(around, plan_, rays, chosen_views(engine.scene(), plan_));
      auto& records = result_.document.records;
      records.insert(records.end(), measured.records.begin(), measured.records.end());
      result_.wrong += measured.wrong;
      bar_.hide();
      print_records(result_.document, std::move(measured.records));
      if (measured.stopped) std::rethrow_exception(measured.stopped);
    }
    result_.messages += engine.messages().size();
  }

  RunResult& result() { return result_; }

 private:
  void begin(const Engine& engine) {
    const std::uint32_t side = engine.device().is_cpu() ? 256 : 1024;
    if (options_.width == 0) options_.width = options_.height = side;
    result_.document = header(engine.device(), plan_, options_);
    bar_.hide();
    fmt::print("{} ({}), subgroup {}, {} x {} pixels, {} repeats, {} entries\n\n", engine.device().name,
               engine.device().driver, engine.device().subgroup_size, options_.width, options_.height, options_.repeats,
               plan_.entries.size() + plan_.sweeps.size());
  }

  void step() {
    bar_.update(double(++done_) / double(total_));
    if (interrupt_.wanted()) throw Interrupted();
  }

  const Plan& plan_;
  RunOptions options_;
  ProgressBar bar_;
  InterruptGuard interrupt_;
  RunResult result_;
  std::size_t done_ = 0, total_ = 0;
};

}  // namespace

std::vector<LoadedScene> load_scenes(const std::vector<std::string>& files, const Plan& plan) {
  std::vector<LoadedScene> scenes;
  std::set<std::string> names;
  for (const std::string& file : files) {
    const auto start = Clock::now();
    LoadedScene loaded{load_scene(file), 0};
    loaded.load_s = std::chrono::duration<double>(Clock::now() - start).count();
    if (!names.insert(loaded.scene.name).second)
      fail(Failure::Arguments, "{}: two scenes are called {}; records are told apart by it, so rename one file", file,
           loaded.scene.name);
    for (const std::string& note : loaded.scene.notes) fmt::print(stderr, "ballot: {}: {}\n", file, note);
    chosen_views(loaded.scene, plan);
    scenes.push_back(std::move(loaded));
  }
  return scenes;
}

RunResult run(const Plan& plan, std::vector<LoadedScene> scenes, RunOptions options,
              const std::function<void(const Document&)>& save) {
  options.engine.queries = plan.queries();
  Run run(plan, options, scenes);
  RunResult& result = run.result();
  for (LoadedScene& scene : scenes) try {
      run.add(std::move(scene));
      result.document.partial = &scene != &scenes.back();
      save(result.document);
    } catch (const Interrupted&) {
      result.document.partial = true;
      break;
    } catch (const Error&) {
      if (result.document.records.empty()) throw;
      result.document.partial = true;
      result.failed = std::current_exception();
      break;
    }
  return std::move(result);
}

}  // namespace ballot::bench
