// Shows what method auto costs and what it is worth: the seconds that it spends on trials in the first runs on a scene,
// and how much slower than the best candidate its choice is afterwards.
//
// A run is a device and an engine of its own, as a process has them; choices pass from run to run in the cache folder,
// which must be empty before (XDG_CACHE_HOME). Speeds are the fastest of the repeats.
#include <algorithm>
#include <limits>

#include "tests/speed/program.h"
#include "tools/bench/markdown.h"

namespace ballot::speed {
namespace {

struct Args {
  std::vector<std::string> scenes, rays;
  std::uint32_t size = 256, runs = 3, repeats = 5;
  std::string device = "cpu";
};

/// Traces a batch of a new engine by auto. Returns the seconds of trials, and what was chosen in `choice`.
double run_once(const std::string& file, const RayKind& kind, const Args& args, std::optional<Choice>& choice) {
  Engine engine(load_scene(file), {.device = args.device});
  const auto batch = engine.make_batch(engine.scene().views[0], kind, args.size, args.size, {.ao_rays = 1});
  Query query{.want = kind.want};
  query.rays = kind.name;
  engine.trace(*batch, query);
  const Choice* found = engine.tracer().choices().find(query);
  if (!found) return 0;
  choice = *found;
  return found->remembered ? 0 : found->seconds;
}

/// Returns how many candidates are left for later runs.
std::size_t untried(const Choice& choice) {
  return std::size_t(
      std::ranges::count_if(choice.candidates, [](const Candidate& c) { return !c.tried && c.put_off_s == 0; }));
}

/// Returns the compile times of the candidates that were put off, in seconds.
std::string put_off(const Choice& choice) {
  std::string text;
  for (const Candidate& c : choice.candidates)
    if (c.put_off_s > 0) text += fmt::format("{}{:.2f}", text.empty() ? "" : ", ", c.put_off_s);
  return text;
}

/// Returns the time of the choice over that of the best candidate.
double regret_of(const std::string& file, const RayKind& kind, const Args& args, const Choice& choice) {
  Engine engine(load_scene(file), {.device = args.device});
  const auto batch = engine.make_batch(engine.scene().views[0], kind, args.size, args.size, {.ao_rays = 1});
  std::vector<double> ms(choice.candidates.size(), std::numeric_limits<double>::infinity());
  for (std::uint32_t r = 0; r <= args.repeats; ++r)
    for (std::size_t i = 0; i < ms.size(); ++i) {
      Query query{.want = kind.want, .method = choice.candidates[i].method};
      query.knobs = choice.candidates[i].knobs;
      const double one = engine.trace(*batch, query).device_ms;
      if (r > 0) ms[i] = std::min(ms[i], one);  // the first compiles
    }
  return ms[0] / *std::ranges::min_element(ms);
}

void run(const Args& args) {
  std::vector<std::string> header{"scene", "rays", "chosen", "not tried", "put off, s"};
  for (std::uint32_t r = 1; r <= args.runs; ++r) header.push_back(fmt::format("run {}, s", r));
  header.push_back("regret");
  bench::Table table(header, 3);
  for (const std::string& file : args.scenes)
    for (const RayKind& kind : kRayKinds) {
      if (!args.rays.empty() && std::ranges::find(args.rays, kind.name) == args.rays.end()) continue;
      std::optional<Choice> choice;
      std::vector<std::string> spent;
      for (std::uint32_t r = 0; r < args.runs; ++r)
        spent.push_back(fmt::format("{:.2f}", run_once(file, kind, args, choice)));
      std::vector<std::string> cells{std::filesystem::path(file).stem().string(), std::string(kind.name)};
      cells.push_back(choice ? choice->chosen().name() : "too few rays");
      cells.push_back(choice ? fmt::to_string(untried(*choice)) : "");
      cells.push_back(choice ? put_off(*choice) : "");
      cells.insert(cells.end(), spent.begin(), spent.end());
      cells.push_back(choice ? fmt::format("{:.2f}", regret_of(file, kind, args, *choice)) : "");
      table.row(std::move(cells));
    }
  fmt::print("{}", table.text());
}

}  // namespace
}  // namespace ballot::speed

int main(int argc, char** argv) {
  ballot::speed::Args args;
  CLI::App app("Shows what method auto spends on trials in the first runs on a scene, and its regret after them");
  app.add_option("SCENE", args.scenes, "scene files")->required();
  app.add_option("--rays", args.rays, "ray kinds [all]")->delimiter(',');
  app.add_option("--size", args.size, "width and height in pixels [256]")->check(CLI::Range(1, 16384));
  app.add_option("--runs", args.runs, "runs on a scene [3]")->check(CLI::Range(1, 100));
  app.add_option("--repeat", args.repeats, "repeats for the regret [5]")->check(CLI::Range(1, 1000));
  app.add_option("--device", args.device, "device [cpu]");
  return ballot::speed::run_program(app, argc, argv, "ballot_auto_runs", [&] { ballot::speed::run(args); });
}
