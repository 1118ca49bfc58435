#include "tools/bench/run.h"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <ctime>
#include <set>

#include "tools/bench/measure.h"
#include "tools/bench/table.h"
#include "tools/program/interrupt.h"

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

std::string utc_now() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  ::gmtime_r(&now, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts);
  return text;
}

class Run {
 public:
  Run(const Plan& plan, const RunOptions& options, const std::vector<LoadedScene>& scenes, const SaveRun& save)
      : plan_(plan), options_(options), save_(save), bar_("measuring"), blocks_left_(scenes.size() * plan.rays.size()) {
    for (const LoadedScene& loaded : scenes)
      for (const RaySet& rays : plan.rays) total_ += steps_in(loaded.scene, rays);
  }

  /// Opens the device for one scene, measures it and prints its tables.
  void add(LoadedScene loaded) {
    const double load_s = loaded.load_s;
    const std::unique_ptr<DeviceScene> world = open(std::move(loaded.scene));
    if (result_.document.device.empty()) begin(*world);
    result_.document.scenes.push_back({world->scene().name, world->bvh_stats(), load_s});
    for (const RaySet& rays : plan_.rays) add_block(*world, rays);
    result_.messages = world->messages().size();
  }

  RunResult& result() { return result_; }
  int signal() const { return interrupt_.signal(); }

 private:
  std::size_t steps_in(const Scene& scene, const RaySet& rays) const {
    return steps_of(plan_, rays, options_, rays.kind ? chosen_views(scene, plan_).size() : rays.files.size());
  }

  std::unique_ptr<DeviceScene> open(Scene scene) {
    bar_.hide();  // only one bar may be drawn at a time
    ProgressBar building("building BVH of " + scene.name);
    auto world =
        std::make_unique<DeviceScene>(std::move(scene), options_.world, [&](double done) { building.update(done); });
    options_.world.context = world->context();
    return world;
  }

  void add_block(DeviceScene& world, const RaySet& rays) {
    const std::size_t done = done_ + steps_in(world.scene(), rays);
    const Surroundings around{world, options_, [this] { step(); }, [this] { poll(); }, [this] { bar_.hide(); }};
    Measured measured = measure(around, plan_, rays, chosen_views(world.scene(), plan_));
    auto& records = result_.document.records;
    records.insert(records.end(), measured.records.begin(), measured.records.end());
    result_.wrong += measured.wrong;
    result_.document.longest = world.context()->longest_pass();
    result_.without += measured.no_rays;
    bar_.hide();
    say("{}", block_table(measured.records));
    std::fflush(stdout);
    if (measured.stopped) std::rethrow_exception(measured.stopped);
    done_ = done;  // views without rays take no steps
    result_.document.partial = --blocks_left_ > 0;
    if (!records.empty()) save_(result_.document);
  }

  void begin(const DeviceScene& world) {
    options_ = with_size(std::move(options_), world.device());
    result_.document = header(world.device(), plan_, options_);
    bar_.hide();
    say("{} ({}), subgroup {}, {} x {} pixels, {} repeats, {} entries\n\n", world.device().name, world.device().driver,
        world.device().subgroup_size, options_.width, options_.height, options_.repeats,
        plan_.entries.size() + plan_.sweeps.size());
  }

  void step() {
    bar_.update(double(++done_) / double(total_));
    poll();
  }
  void poll() const {
    if (interrupt_.wanted()) throw Interrupted();
  }

  const Plan& plan_;
  RunOptions options_;
  const SaveRun& save_;
  ProgressBar bar_;
  InterruptGuard interrupt_;
  RunResult result_;
  std::size_t blocks_left_, done_ = 0, total_ = 0;
};

}  // namespace

Document header(const DeviceInfo& device, const Plan& plan, const RunOptions& options) {
  Document d;
  d.device = device.name;
  d.driver = device.driver;
  d.cpu = device.is_cpu();
  d.subgroup_size = device.subgroup_size;
  d.commit = commit();
  d.command = options.command;
  for (const char* name : kEnvironment)
    if (const char* value = std::getenv(name)) d.environment[name] = value;
  d.clock = device.timestamp_bits > 0 && device.timestamp_ns > 0 ? "GPU timestamps" : "wall";
  d.date = utc_now();
  d.size = {options.width, options.height};
  d.ao_rays = options.kinds.ao_rays;
  d.ao_radius = std::stod(fmt::format("{}", options.kinds.ao_radius));  // 0.05, not 0.05f converted to double
  d.offset = options.kinds.offset;
  d.repeats = options.repeats;
  d.sweep_repeats = sweep_repeats(plan, options);
  return d;
}

RunOptions with_size(RunOptions options, const DeviceInfo& device) {
  if (options.width == 0) options.width = options.height = device.is_cpu() ? 256 : 1024;
  return options;
}

std::vector<LoadedScene> load_scenes(const std::vector<std::string>& files, const Plan& plan,
                                     const LoadOptions& options, bool checks) {
  std::vector<LoadedScene> scenes;
  std::set<std::string> names;
  for (const std::string& file : files) {
    const auto start = Clock::now();
    LoadedScene loaded{load_scene(file, options), 0};
    loaded.load_s = std::chrono::duration<double>(Clock::now() - start).count();
    if (!plan.given_views.empty()) loaded.scene.views = plan.given_views;
    if (!names.insert(loaded.scene.name).second)
      fail(Failure::Arguments, "{}: two scenes are called {}; names must differ, so rename one of the files", file,
           loaded.scene.name);
    for (const std::string& note : loaded.scene.notes) say_aside("ballot: {}: {}\n", file, note);
    if (checks) need_triangles(loaded.scene, "the check of answers");
    chosen_views(loaded.scene, plan);
    scenes.push_back(std::move(loaded));
  }
  return scenes;
}

void say_end(const RunResult& result) {
  if (result.failed) std::rethrow_exception(result.failed);
  if (result.signal != 0) say_aside("ballot: interrupted; what was measured is kept\n");
  if (result.without > 0) say_aside("ballot: {} pairs of scene and ray kind have no rays (above)\n", result.without);
  if (result.messages > 0) say_aside("ballot: {} validation messages (above)\n", result.messages);
}

RunResult run(const Plan& plan, std::vector<LoadedScene> scenes, RunOptions options, const SaveRun& save) {
  options.world.queries = plan.queries();
  Run run(plan, options, scenes, save);
  RunResult& result = run.result();
  for (LoadedScene& scene : scenes) try {
      run.add(std::move(scene));
    } catch (const Interrupted&) {
      result.document.partial = true;
      result.signal = run.signal();
      break;
    } catch (const Error&) {
      if (result.document.records.empty()) throw;
      result.document.partial = true;
      result.failed = std::current_exception();
      break;
    }
  if (result.document.records.empty() && result.without > 0)
    fail(Failure::Work, "nothing was measured: no scene has rays of the chosen kinds");
  return std::move(result);
}

}  // namespace ballot::bench
