#include <set>

#include "tools/auto_table.h"
#include "tools/views_file.h"

namespace ballot::cli {

namespace {

namespace fs = std::filesystem;

struct Args {
  EngineArgs engine;
  QueryArgs query;
  std::string view = "all", size = "1024x1024", shading = "eyelight", out = ".";
  std::uint32_t spp = 1;
  std::string heat = "nodes", views_file;
  bool png = false, stats = false;
};

/// <scene>-<view>, as a name of one file: no folder separator, no control character.
std::string file_name(const Scene& scene, const View& view) {
  std::string name = fmt::format("{}-{}", scene.name, view.name);
  for (char& c : name)
    if (c == '/' || static_cast<unsigned char>(c) < 32) c = '_';
  return name;
}

/// One file if the name ends in .exr, which then takes a single view; else a folder of <scene>-<view>.exr, a file each.
std::vector<fs::path> outputs_of(const Args& args, const Scene& scene, const std::vector<const View*>& views) {
  const fs::path out = args.out;
  if (out.extension() == ".exr") {
    if (views.size() == 1) return {out};
    fail(Failure::Arguments, "--out {}: {} views do not fit one file; name a folder, or one of them with --view",
         args.out, views.size());
  }
  std::vector<fs::path> files;
  std::set<std::string> names;
  for (const View* view : views) {
    const std::string given = file_name(scene, *view);
    std::string name = given;
    for (std::size_t n = 2; !names.insert(name).second; ++n) name = fmt::format("{}_{}", given, n);
    files.push_back(out / (name + ".exr"));
  }
  return files;
}

fs::path png_beside(fs::path exr) { return exr.replace_extension(".png"); }

/// Makes the folder, and finds out before the work begins what could not be written.
void prepare(const Args& args, const std::vector<fs::path>& files) {
  const fs::path out = args.out;
  if (out.extension() != ".exr") {
    std::error_code error;
    fs::create_directories(out, error);
    if (error) fail(Failure::Work, "--out {}: the folder cannot be made: {}", args.out, error.message());
  }
  for (const fs::path& file : files) {
    check_writable(file);
    if (args.png) check_writable(png_beside(file));
  }
}

std::vector<const View*> chosen_views(const Args& args, const Scene& scene) {
  std::vector<const View*> views;
  if (args.view != "all") return {&find_view(scene, args.view)};
  for (const View& v : scene.views) views.push_back(&v);
  return views;
}

void render_view(const Args& args, Opened& opened, const View& view, const RenderOptions& options, const fs::path& exr,
                 nlohmann::json& json) {
  Engine& engine = *opened.engine;
  RenderTimes times;
  Image image;
  {
    ProgressBar bar("rendering " + view.name);
    image = engine.render(view, options, &times, [&](double done) { bar.update(done); });
  }
  write_exr(exr, image);
  const fs::path png = png_beside(exr);
  if (args.png) write_png(png, image);
  fmt::print("  {:<10} {:7.3f} s  generate {:8.3f} ms  trace {:9.3f} ms  shade {:8.3f} ms  {:8.2f} Mrays/s  {}{}\n",
             view.name, times.seconds, times.generate_ms, times.trace_ms, times.shade_ms, times.mrays_per_s(),
             exr.string(), args.png ? " + .png" : "");
  if (times.heat_top > 0) fmt::print("  {:<10} {}: yellow is {:.4g}\n", "", options.heat, times.heat_top);
  json["records"].push_back({{"scene", engine.scene().name},
                             {"view", view.name},
                             {"rays", "primary"},
                             {"any", false},
                             {"method", options.query.method},
                             {"knobs", options.query.knobs},
                             {"variant", std::get<std::string>(image.attributes.at("method"))},
                             {"numeric", options.query.numeric},
                             {"shading", options.shading},
                             {"spp", options.spp},
                             {"width", options.width},
                             {"height", options.height},
                             {"ray_count", times.rays},
                             {"seconds", times.seconds},
                             {"generate_ms", times.generate_ms},
                             {"trace_ms", times.trace_ms},
                             {"shade_ms", times.shade_ms},
                             {"mrays_per_s", times.mrays_per_s()},
                             {"exr", exr.string()},
                             {"png", args.png ? png.string() : ""}});
}

int run(const Args& args) {
  RenderOptions options;
  parse_size(args.size, options.width, options.height);
  options.spp = args.spp;
  options.shading = args.shading;
  options.heat = find_heat(args.heat).name;
  options.stats = args.stats;
  options.query = args.query.query();
  check_options(options);
  const fs::path out = args.out;
  if (out.extension() == ".exr")
    check_writable(out);
  else if (!out.extension().empty() && !fs::is_directory(out))
    fail(Failure::Arguments,
         "--out {}: pictures are EXR files; name a FILE.exr, or a folder, and --png for a PNG beside it", args.out);
  std::vector<View> views_given;
  if (!args.views_file.empty()) views_given = read_views(args.views_file);
  Opened opened = open_scene(args.engine, {options.query}, [&](Scene& scene) {
    if (!views_given.empty()) scene.views = views_given;
    outputs_of(args, scene, chosen_views(args, scene));
  });
  Engine& engine = *opened.engine;
  const auto views = chosen_views(args, engine.scene());
  const auto files = outputs_of(args, engine.scene(), views);
  prepare(args, files);
  Query query = options.query;
  query.rays = kPrimaryRays;
  const Variant variant = engine.tracer().variant(query);
  fmt::print("{}: {} triangles on {} ({}), subgroup {}\n  {}\n", engine.scene().name, engine.scene().triangles.size(),
             engine.device().name, engine.device().driver, variant.how.subgroup,
             query.method == kAuto ? "method auto" : variant.name());
  fmt::print("  load {:.3f} s, device {:.3f} s, BVH {:.3f} s{}\n", opened.load_s, engine.start_times().device_s,
             engine.start_times().bvh_s, engine.bvh().stats.from_cache ? " (cached)" : "");
  nlohmann::json json = record_header(engine, opened.load_s);
  for (std::size_t i = 0; i < views.size(); ++i) render_view(args, opened, *views[i], options, files[i], json);
  if (const std::string line = choice_line(engine, query); !line.empty())
    fmt::print("  {}\n  {}\n", line, engine.tracer().variant(query).name());
  const KernelTimes& kernel = engine.tracer().kernel(query).times();
  fmt::print(
      "  kernel: {} bytes of SPIR-V {} in {:.1f} ms, pipeline {:.1f} ms (a CPU driver compiles at the first "
      "dispatch)\n",
      kernel.spirv_bytes, kernel.from_cache ? "from the cache" : "compiled", kernel.spirv_ms, kernel.pipeline_ms);
  write_json(args.engine.json, json);
  return finish(engine);
}

}  // namespace

void add_render(CLI::App& app, int& result) {
  auto args = std::make_shared<Args>();
  CLI::App* cmd = app.add_subcommand("render", "views to EXR: colour, distance, normals and primitive numbers");
  std::string shadings, heats;
  for (const HeatKind& h : kHeatKinds) heats += fmt::format("\n  {:<12} {}", h.name, h.what);
  for (const Shading& s : kShadings) shadings += fmt::format("\n  {:<12} {}", s.name, s.summary);
  for (const Integrator& i : kIntegrators) shadings += fmt::format("\n  {:<12} {}", i.name, i.summary);
  args->engine.add_to(*cmd, true);
  args->query.add_to(*cmd);
  cmd->add_option("--view", args->view, "name of a camera in the scene, or 'all' [all]");
  cmd->add_option("--views-file", args->views_file,
                  "JSON file whose views stand for the scene's; key V of ballot view writes one");
  cmd->add_option("--size", args->size, "WIDTHxHEIGHT in pixels [1024x1024]");
  cmd->add_option("--shading", args->shading, "what to draw [eyelight]" + shadings);
  cmd->add_option("--heat", args->heat, "what --shading heat shows, dark blue for 0 to yellow [nodes]" + heats);
  cmd->add_flag("--stats", args->stats, "also channels stats.*, one for each kind of heat, by the instrumented kernel");
  cmd->add_option("--spp", args->spp, "samples a pixel [1: through its centre]");
  cmd->add_option("--out", args->out, "FILE.exr for one view, or a folder [.]");
  cmd->add_flag("--png", args->png, "also write a PNG beside each EXR");
  cmd->callback([args, &result] { result = run(*args); });
}

}  // namespace ballot::cli
