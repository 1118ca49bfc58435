#include <chrono>
#include <set>

#include "tools/program/help.h"
#include "tools/program/picture_size.h"
#include "tools/program/views_file.h"
#include "tools/render/bands.h"
#include "tools/render/denoise.h"
#include "tools/render/frames.h"
#include "tools/render/job.h"
#include "tools/render/light.h"
#include "tools/render/print.h"
#include "tools/render/tone.h"

namespace ballot::cli {

namespace {

namespace fs = std::filesystem;

struct RenderArgs {
  SceneArgs world;
  QueryArgs query;
  std::string view = "all", size = "1024x1024", shading = "eyelight", out = ".";
  ToneArgs tone;
  std::string heat = "nodes", views_file;
  bool png = false, stats = false, resume = false, verbose = false, denoise = false;
  std::optional<Denoiser> denoiser = {};
  std::string crop, tiles, reference;
  LightArgs light;
  std::vector<std::string> aovs;
  std::int32_t bounces = -1;
  std::uint32_t seed = 0, band = 0;
  float ao_radius = RenderOptions{}.ao_radius;
  double checkpoint_s = RenderJob{}.checkpoint_s;
  FrameArgs frames;
};

/// What the frame of a picture is, and what a JSON record tells of it.
struct FrameOf {
  const FramePlan& plan;
  const Frame& frame;
  std::string job;  // of the view
  nlohmann::json json;
};

RenderOptions options_of(const RenderArgs& args) {
  RenderOptions o;
  parse_size(args.size, o.width, o.height);
  o.spp = args.tone.samples(args.shading);
  o.clamp = args.tone.clamp_for(args.shading, !args.reference.empty());
  o.shading = args.shading;
  o.heat = find_heat(args.heat).name;
  o.stats = args.stats;
  o.query = args.query.query();
  o.aovs = args.aovs;
  o.bounces = args.bounces;
  o.ao_radius = args.ao_radius;
  o.seed = args.seed;
  if (!args.crop.empty()) {
    const auto c =
        numbers_of<4>(args.crop, ',', "--crop", "X0,Y0,X1,Y1: the pixels with X0 <= x < X1 and Y0 <= y < Y1");
    o.crop = {c[0], c[1], c[2], c[3]};
    if (o.crop == Window{})
      fail(Failure::Arguments, "--crop {}: the window is empty; X0 must be below X1, Y0 below Y1", args.crop);
  }
  if (!args.tiles.empty()) {
    const auto t = numbers_of<2>(args.tiles, '/', "--tiles", "I/N: part I of N parts, I from 0 to N - 1");
    o.shard = {t[0], t[1]};
  }
  check_options(o);
  if (args.denoise) check_denoised(o);
  args.tone.tone_for(args.shading);
  if (args.png && !o.wants("color") && o.shading != "heat")
    fail(Failure::Arguments, "--png: the picture has no colours; name color in --aov too");
  return o;
}

/// Returns <scene>-<view> as a file name: folder separators and control characters become '_'.
std::string file_name(const Scene& scene, const View& view) {
  std::string name = fmt::format("{}-{}", scene.name, view.name);
  for (char& c : name)
    if (c == '/' || static_cast<unsigned char>(c) < 32) c = '_';
  return name;
}

/// Returns the EXR file of each view. --out FILE.exr takes a single view; any other --out is a folder, which gets a
/// file <scene>-<view>.exr for each view. Throws Error(Arguments) for FILE.exr and several views.
std::vector<fs::path> outputs_of(const RenderArgs& args, const Scene& scene, const std::vector<const View*>& views) {
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

/// Makes the output folder and checks, before the work begins, that every file can be written, or the first frame's.
void prepare(RenderArgs& args, const FramePlan& plan, std::vector<fs::path> files) {
  if (plan.numbered)
    for (fs::path& file : files) file = frame_file(file, plan.frames[0].number);
  const fs::path out = args.out;
  if (out.extension() != ".exr") {
    std::error_code error;
    fs::create_directories(out, error);
    if (error) fail(Failure::Work, "--out {}: cannot create the folder: {}", args.out, error.message());
  }
  for (const fs::path& file : files) {
    args.world.files.writes("--out", file);
    if (args.png) args.world.files.writes("--png", png_beside(file));
  }
  args.world.files.check_read();
}

std::vector<const View*> chosen_views(const RenderArgs& args, const Scene& scene) {
  std::vector<const View*> views;
  if (args.view != "all") return {&find_view(scene, args.view)};
  for (const View& v : scene.views) views.push_back(&v);
  return views;
}

void render_view(const RenderArgs& args, Opened& opened, const View& view, const RenderJob& job, const fs::path& exr,
                 const FrameOf& of, nlohmann::json& json) {
  DeviceScene& world = *opened.world;
  const RenderOptions& options = job.options;
  const bool whole = job.reference || args.denoiser;
  const BandPlan plan = plan_bands(world, view, options, {args.band, whole, args.png});
  if (args.verbose || plan.in_bands()) announce(view, options, plan, world.device().is_cpu());
  Rendered rendered = plan.in_bands() ? render_bands(world, view, job, exr, plan) : render_job(world, view, job, exr);
  const auto written = std::chrono::steady_clock::now();
  const RenderTimes& times = rendered.times;
  Image& image = rendered.image;
  if (args.denoiser) denoise(*args.denoiser, world, view, options, image);
  label_frame(image, of.plan, of.frame, of.job);
  const Tone tone = args.tone.tone_for(args.shading);
  label_tone(image, tone);
  const fs::path png = png_beside(exr);
  const Links links = exr == fs::path(args.out) ? Links::Follow : Links::Replace;  // the user did not name the latter
  if (plan.in_bands()) join_bands(image, options, plan, exr, args.png ? png : fs::path(), tone, links);
  if (!plan.in_bands()) write_exr(exr, image, links);
  if (!plan.in_bands() && args.png) write_png(png, image, tone, Links::Replace);
  finish_job(exr);
  const double write_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - written).count();
  const Wall wall{times.device_ms * 1e-3, rendered.film_s, write_s, rendered.seconds + write_s};
  if (rendered.bands_there > 0)
    say("  {:<10} {} of {} bands were complete\n", view.name, rendered.bands_there, plan.bands.size());
  if (rendered.resumed_at > 0) say("  {:<10} resumed from {} samples\n", view.name, rendered.resumed_at);
  say("  {:<10} {:7.3f} s  {:8.2f} Mrays/s  {}{}\n", view.name, wall.wall_s, times.mrays_per_s(), exr.string(),
      args.png ? " + .png" : "");
  if (args.verbose) print_times(times, wall, args.png);
  if (!rendered.errors.empty()) report_errors(rendered, exr);
  if (times.heat_top > 0) say("  {:<10} heat map of {}: yellow stands for {:.4g}\n", "", options.heat, times.heat_top);
  json["records"].push_back({{"scene", world.scene().name},
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
                             {"passes", passes_json(times)},
                             {"wall", wall_json(wall)},
                             {"scene_bytes", world.bvh_stats().bytes},
                             {"render_bytes", world.render_bytes()},
                             {"exr", exr.string()},
                             {"png", args.png ? png.string() : ""}});
  json["records"].back().update(of.json);
}

/// Moves the scene to a frame. Returns the JSON of it.
nlohmann::json begin_frame(DeviceScene& world, const FramePlan& plan, const Frame& frame) {
  if (plan.animation.empty()) return nlohmann::json::object();
  if (plan.numbered) world.set_time(plan.clip, frame.seconds, plan.update);
  const DeviceScene::Update& update = world.last_update();
  const double decay = world.refit_policy().decay();
  if (plan.numbered)
    say("frame {:04}, {:.4f} s: pose {:.3f} ms, tree {} and scene made ready in {:.3f} ms, SAH {:.3f} of the build's\n",
        frame.number, frame.seconds, update.pose_s * 1e3, update.refitted ? "refitted" : "built", update.seconds * 1e3,
        decay);
  return {
      {"animation", plan.animation}, {"time", frame.seconds},       {"frame", frame.number}, {"pose_s", update.pose_s},
      {"update_s", update.seconds},  {"refitted", update.refitted}, {"decay", decay}};
}

/// Renders the frames of a plan. Returns how many pictures were there already.
std::size_t render_frames(const RenderArgs& args, Opened& opened, const FramePlan& plan, const RenderJob& job,
                          const std::vector<const View*>& views, const std::vector<fs::path>& files,
                          nlohmann::json& json) {
  std::vector<std::string> jobs(views.size());
  if (plan.numbered)
    for (std::size_t i = 0; i < views.size(); ++i)
      jobs[i] = job_of(*opened.world, *views[i], job.options) + (args.denoiser ? " denoised" : "");
  std::size_t there = 0;
  for (const Frame& frame : plan.frames) {
    nlohmann::json at;  // null: the scene has not moved to the frame yet
    for (std::size_t i = 0; i < views.size(); ++i) {
      const fs::path file = plan.numbered ? frame_file(files[i], frame.number) : files[i];
      if (plan.numbered && job.resume && (!args.png || fs::exists(png_beside(file))) &&
          has_frame(file, plan, frame, jobs[i])) {
        ++there;
        continue;
      }
      if (at.is_null()) at = begin_frame(*opened.world, plan, frame);
      render_view(args, opened, *views[i], job, file, {plan, frame, jobs[i], at}, json);
    }
  }
  return there;
}

Image read_reference(const RenderArgs& args, const RenderOptions& options) {
  Image reference = read_exr(args.reference);
  const Window w = options.window();
  if (reference.width != w.x1 - w.x0 || reference.height != w.y1 - w.y0)
    fail(Failure::Arguments, "--reference {}: has {} x {} pixels, but the picture will have {} x {}", args.reference,
         reference.width, reference.height, w.x1 - w.x0, w.y1 - w.y0);
  for (const char* name : {"R", "G", "B"}) channel_in(args.reference, reference, name);
  if (options.shard.count > 1 || !options.wants("color"))
    fail(Failure::Arguments,
         "--reference: needs the whole picture with its colours; leave out --tiles, and add color to --aov");
  return reference;
}

/// Checks, before the scene is loaded, that --out names what can be written.
void check_out(const RenderArgs& args) {
  const fs::path out = args.out;
  if (out.extension() == ".exr") {
    check_writable(args.frames.frames.empty() ? out : frame_file(out, 0));
    return;
  }
  if (!out.extension().empty() && !fs::is_directory(out))
    fail(Failure::Arguments,
         "--out {}: pictures are EXR files; name a FILE.exr, or a folder, and --png for a PNG beside it", args.out);
  check_folder("--out", out);
}

int run_render(RenderArgs& args) {
  args.world.note_files();
  args.world.files.reads("--reference", args.reference);
  RenderJob job{.options = options_of(args), .checkpoint_s = args.checkpoint_s, .resume = args.resume};
  job.again = command_line() + (args.resume ? "" : " --resume");
  const RenderOptions& options = job.options;
  if (!(args.checkpoint_s >= 0))
    fail(Failure::Arguments, "--checkpoint: {} s is not a time of 0 or more", args.checkpoint_s);
  if (!args.reference.empty()) job.reference = read_reference(args, options);
  args.frames.check();
  check_out(args);
  if (args.denoise) args.denoiser.emplace();
  std::vector<View> views_given;
  if (!args.views_file.empty()) views_given = read_views(args.views_file);
  FramePlan plan;
  Opened opened = open_scene(args.world, {options.query}, [&](Scene& scene) {
    plan = plan_frames(args.frames, scene);
    if (!plan.animation.empty() && !plan.numbered)
      set_pose(scene, &scene.animation->clips[plan.clip], plan.frames[0].seconds);
    if (!views_given.empty()) scene.views = views_given;
    const auto wanted = chosen_views(args, scene);
    outputs_of(args, scene, wanted);
    args.light.apply(scene, wanted, args.shading);
  });
  DeviceScene& world = *opened.world;
  if (const std::string note = world.picture_note(); !note.empty())
    say_aside("ballot: {}: {}\n", args.world.scene, note);
  const auto views = chosen_views(args, world.scene());
  const auto files = outputs_of(args, world.scene(), views);
  prepare(args, plan, files);
  Query query = options.query;
  query.rays = kPrimaryRays;
  say("{}: {} on {}\n", world.scene().name, pieces_text(world.scene_facts()), world.device().name);
  if (args.verbose)
    say("  {}, subgroup {}; load {:.3f} s, device {:.3f} s, BVH {:.3f} s{}\n", world.device().driver,
        world.tracer().variant(query).config.subgroup, opened.load_s, opened.device_s, world.start_times().bvh_s,
        world.bvh_stats().from_cache ? " (cached)" : "");
  nlohmann::json json = record_header(world, opened.load_s);
  if (const std::size_t there = render_frames(args, opened, plan, job, views, files, json); there > 0)
    say("  {} pictures were complete and left out\n", there);
  if (args.verbose) print_kernel(world, query);
  if (args.verbose) print_longest(world.context()->longest_pass());
  write_json(args.world.json, world, json);
  return leave(world);
}

void add_light_options(CLI::App& cmd, RenderArgs& args) {
  args.light.add_to(cmd);
  std::string bounces;
  for (const Integrator& i : kIntegrators)
    if (i.last_depth) bounces += fmt::format("{}{} {}", bounces.empty() ? "" : ", ", i.name, i.last_depth);
  cmd.add_option("--bounces", args.bounces, fmt::format("largest number of bounces of a path, 0 to 64 [{}]", bounces));
  cmd.add_option("--ao-radius", args.ao_radius,
                 "length of the rays of --shading ao, as a share of the scene's diagonal [0.1]");
  cmd.add_option("--seed", args.seed,
                 fmt::format("seed of the random numbers of {}, a whole number [0]", names_of(kIntegrators)));
}

void add_part_options(CLI::App& cmd, RenderArgs& args) {
  std::string aovs;
  for (const Aov& a : kAovs)
    aovs += fmt::format("\n  {:<12} {}{}", a.name, a.channels, a.by_default ? "" : "; not by default");
  cmd.add_option("--aov", args.aovs,
                 "comma-separated list of the channel groups that the EXR gets; e.g. --aov color,depth" + aovs)
      ->delimiter(',');
  cmd.add_option("--crop", args.crop,
                 "X0,Y0,X1,Y1: render only the pixels with X0 <= x < X1 and Y0 <= y < Y1; the EXR gets a smaller data\n"
                 "window; e.g. --crop 0,0,256,128");
  cmd.add_option("--tiles", args.tiles,
                 "I/N: render part I of N parts, I from 0: every N-th tile from tile I on; e.g. --tiles 0/4.\n"
                 "'ballot merge' joins the N pictures; the result has the same bits as one render");
  cmd.add_option("--band", args.band,
                 "rows of a band: a large picture is rendered band by band, as files OUT.rows-FIRST-LAST.exr that are\n"
                 "joined at the end; the result has the same bits [of large pictures, as many as suit the memory]");
  cmd.add_option("--checkpoint", args.checkpoint_s,
                 "seconds between checkpoints, which are OUT.checkpoint.exr beside OUT.exr; 0: none [60]");
  cmd.add_flag("--resume", args.resume,
               "continue from the checkpoint if there is one; the picture gets the same bits as without a break");
  cmd.add_option("--reference", args.reference,
                 "EXR to compare with while rendering: prints RMSE, relative MSE and FLIP over time, and writes\n"
                 "OUT.errors.json, which tools/report draws");
}

}  // namespace

void add_render(CLI::App& app, int& result) {
  const auto [cmd, args] = add_command<RenderArgs>(
      app, result, "render", run_render, "renders views to EXR: colour, distance, normals and primitive numbers");
  std::string shadings, heats;
  for (const HeatKind& h : kHeatKinds) heats += fmt::format("\n  {:<12} {}", h.name, h.what);
  for (const Shading& s : kShadings) shadings += fmt::format("\n  {:<12} {}", s.name, s.summary);
  for (const Integrator& i : kIntegrators) shadings += fmt::format("\n  {:<12} {}", i.name, i.summary);
  args->world.add_to(*cmd, true);
  args->query.add_to(*cmd);
  cmd->add_option("--view", args->view,
                  "name of a camera of the scene, or 'all' [all]; 'ballot info SCENE' lists them");
  cmd->add_option("--views-file", args->views_file,
                  "JSON file whose views replace the scene's own; key V of 'ballot view' writes one");
  cmd->add_option("--size", args->size, "WIDTHxHEIGHT in pixels [1024x1024]");
  cmd->add_option("--shading", args->shading, "what to draw [eyelight]" + shadings);
  cmd->add_option("--heat", args->heat,
                  "counter that --shading heat shows, from dark blue for 0 to yellow [nodes]" + heats);
  cmd->add_flag("--stats", args->stats,
                "add a channel stats.* for each counter of --heat; traces with the slower counting kernel");
  args->tone.add_to(*cmd);
  cmd->add_flag(
      "--denoise", args->denoise,
      "remove the noise of ao, whitted and path by Intel's Open Image Denoise, where it is installed; the EXR\n"
      "keeps the rendered colours as noisy.R, noisy.G, noisy.B and gets albedo.R, albedo.G, albedo.B");
  add_light_options(*cmd, *args);
  add_part_options(*cmd, *args);
  args->frames.add_to(*cmd);
  cmd->add_option("--out", args->out,
                  "FILE.exr for one view, or a folder, which gets <scene>-<view>.exr for each view [.]");
  cmd->add_flag("--png", args->png, "also write a PNG beside each EXR");
  add_verbose(*cmd, args->verbose);
  show_first(*cmd, {"--view", "--size", "--shading", "--spp", "--sky", "--lamp", "--out", "--png", "--time", "--frames",
                    "--method", "--device", "--verbose"});
}

}  // namespace ballot::cli
