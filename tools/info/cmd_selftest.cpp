// ballot selftest: what is installed, the devices, and a short test with a picture. `python -m ballot` does the same.
#include "tools/hard/generate.h"
#include "tools/info/device_table.h"
#include "tools/program/cli.h"
#include "tools/program/help.h"

namespace ballot::cli {

namespace {

constexpr const char* kVariables[] = {"BALLOT_VULKAN_LOADER", "VK_DRIVER_FILES",        "VK_ICD_FILENAMES",
                                      "BALLOT_SHADERS",       "LP_NATIVE_VECTOR_WIDTH", "XDG_CACHE_HOME"};
constexpr std::string_view kShades = " .:-=+*#%@";  // of a picture in text, from dark to bright
constexpr double kMostError = 1e-5;                 // of a distance in the cube, which is about 1

struct SelftestArgs {
  std::string device, png, json;
  CommandFiles files;
};

/// The answers of the self test that are wrong, and its times.
struct Tested {
  std::size_t rays = 0, wrong_hits = 0, points = 0, wrong_points = 0;
  double first_ms = 0, next_ms = 0;
};

/// Returns the caches' folder, and whether it can be written.
std::string cache_text() {
  const std::filesystem::path folder = cache_folder(), file = folder / "selftest";
  const bool writable = write_cache(file, std::span<const std::byte>());
  std::error_code none_is_left;
  std::filesystem::remove(file, none_is_left);
  return folder.string() + (writable ? "" : "; it cannot be written, so kernels are compiled in each process");
}

void print_system() {
  say("ballot    {}, commit {}\nprogram   {}\ncaches    {}\n", BALLOT_VERSION, commit(), program_file().string(),
      cache_text());
  for (const char* name : kVariables)
    if (const char* value = std::getenv(name)) say("variable  {}={}\n", name, value);
}

float longest(const glm::vec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

/// Asks the cube [-1, 1]^3 for hits from its middle and for closest points inside, which are known.
Tested test_cube(const std::shared_ptr<Context>& context) {
  DeviceScene cube(hard::scene_of("cube", hard::cube_grid(1, 1)),
                   {.device = "", .context = context, .use_cache = false});
  hard::Random random(1);
  Tested tested{.rays = 10'000, .points = 1000};
  std::vector<Ray> rays;
  for (std::size_t i = 0; i < tested.rays; ++i) rays.push_back({glm::vec3(0), 0, random.direction(), hard::kFar});
  std::vector<Hit> hits(rays.size());
  for (int run = 0; run < 5; ++run) {
    const Timer timer;
    cube.trace(rays, hits);
    (run ? tested.next_ms : tested.first_ms) = timer.ms();
  }
  for (std::size_t i = 0; i < rays.size(); ++i)
    tested.wrong_hits += !(std::abs(hits[i].t * longest(rays[i].dir) - 1) < kMostError);
  std::vector<ProbePoint> points;
  for (std::size_t i = 0; i < tested.points; ++i) points.push_back({random.point(0.9f), hard::kInf});
  std::vector<Nearest> nearest(points.size());
  cube.points().nearest(points, nearest);
  for (std::size_t i = 0; i < points.size(); ++i)
    tested.wrong_points += !(std::abs(nearest[i].distance - (1 - longest(points[i].at))) < kMostError);
  return tested;
}

/// Prints a picture in characters: two rows of pixels a line.
void print_picture(const Image& image) {
  const std::vector<float>&red = image.channel("R").floats, &alpha = image.channel("A").floats;
  for (std::uint32_t y = 0; y + 1 < image.height; y += 2) {
    std::string line;
    for (std::size_t at = std::size_t(y) * image.width; line.size() < image.width; ++at) {
      const float light = alpha[at] > 0 ? std::clamp(red[at], 0.f, 0.999f) : 0;
      line += kShades[std::size_t(light * float(kShades.size()))];
    }
    say("          {}\n", line.substr(0, line.find_last_not_of(' ') + 1));
  }
}

void draw(const std::shared_ptr<Context>& context, const std::string& png) {
  DeviceScene ball(hard::scene_of("ball", hard::icosphere(4)), {.device = "", .context = context, .use_cache = false});
  const std::uint32_t size = png.empty() ? 40 : 512, samples = png.empty() ? 1 : 4;
  const Image image = ball.render(ball.scene().views[0], {.width = size, .height = size, .spp = samples});
  if (png.empty()) return print_picture(image);
  write_png(png, image);
  say("picture   {}\n", png);
}

int run_selftest(SelftestArgs& args) {
  args.png = args.files.writes("--png", args.png).string();
  args.json = args.files.writes("--json", args.json).string();
  print_system();
  nlohmann::json json{{"version", BALLOT_VERSION}, {"commit", commit()}, {"devices", print_devices(args.device)}};
  const auto context = DeviceScene::open_device({.device = args.device});
  const Tested t = test_cube(context);
  say("self test {} rays, {} wrong; {} closest points, {} wrong\n", t.rays, t.wrong_hits, t.points, t.wrong_points);
  say("          the first call took {:.3f} s, the next ones {:.2f} ms\n", t.first_ms / 1000, t.next_ms);
  draw(context, args.png);
  json["wrong_hits"] = t.wrong_hits;
  json["wrong_points"] = t.wrong_points;
  write_json(args.json, json);
  return t.wrong_hits + t.wrong_points ? 1 : 0;
}

}  // namespace

void add_selftest(CLI::App& app, int& result) {
  const auto [cmd, args] = add_command<SelftestArgs>(
      app, result, "selftest", run_selftest,
      "prints versions, caches and devices, and tests a device in a second: the start of every bug report");
  cmd->add_option("--device", args->device, "an index, part of a name, 'gpu' or 'cpu'");
  cmd->add_option("--png", args->png, "FILE.png for the picture; without it, it is printed in characters");
  cmd->add_option("--json", args->json, "FILE.json for the devices and the numbers of wrong answers");
  show_first(*cmd, {"--device", "--png", "--json"});
}

}  // namespace ballot::cli
