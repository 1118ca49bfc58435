#include <malloc.h>

#include "tools/program/cli.h"
#include "tools/program/help.h"
#include "tools/program/picture_size.h"
#include "tools/render/light.h"
#include "tools/view/session.h"

namespace ballot::cli {

namespace {

struct ViewArgs {
  SceneArgs world;
  QueryArgs query;
  view::SessionOptions session;
  std::string size = "1280x720";
  LightArgs light;
  double target_ms = 0;
  bool no_scale = false;
};

int run_view(const ViewArgs& args) {
  check_scene_file(args.world.scene);
  view::SessionOptions o = args.session;
  o.scene = args.world.scene;
  o.world = args.world.options();
  o.load = args.world.load_options();
  parse_size(args.size, o.width, o.height);
  check_options(RenderOptions{.width = o.width, .height = o.height});
  o.settings.query = args.query.query();
  o.settings.rays = find_ray_kind(o.settings.rays).name;
  o.settings.shading = view::shading_named(o.settings.shading);
  if (o.settings.integrator() && o.settings.rays != kPrimaryRays)
    fail(Failure::Arguments, "--shading {}: it traces rays of its own; leave out --rays", o.settings.shading);
  o.light = [&args](Scene& scene) {
    std::vector<const View*> views;
    for (const View& v : scene.views) views.push_back(&v);
    args.light.apply(scene, views, "path");  // whatever is drawn first: one may switch
  };
  o.settings.heat = find_heat(o.settings.heat).name;
  if (o.settings.samples < 1 || o.settings.samples > 65536)
    fail(Failure::Arguments, "--spp: {} is not between 1 and 65536", o.settings.samples);
  if (args.target_ms < 0 || args.target_ms > 10000)
    fail(Failure::Arguments, "--target: {} is not between 0 and 10000 ms", args.target_ms);
  o.target_given = args.target_ms > 0;
  if (o.target_given) o.settings.target_ms = float(args.target_ms);
  o.settings.scale = !args.no_scale;
  // A window may be resized for hours, and on lavapipe its images are allocated by malloc. By default malloc raises its
  // mmap threshold and keeps the images in its heap, which then grew by 18 MB in 300 changes of size. With a fixed
  // threshold it returns each image to the system: no growth in 600 changes.
  mallopt(M_MMAP_THRESHOLD, 1 << 20);
  view::Session session(std::move(o));
  const std::size_t messages = session.run();
  if (messages == 0) return 0;
  say_aside("ballot: {} validation messages (above)\n", messages);
  return 1;
}

}  // namespace

void add_view(CLI::App& app, int& result) {
  auto args = std::make_shared<ViewArgs>();
  CLI::App* cmd =
      app.add_subcommand("view", "opens a window to fly through a scene, with methods and heat maps to switch live");
  std::string kinds, shadings, heats;
  for (const RayKind& k : kRayKinds) kinds += fmt::format("\n  {:<12} {}", k.name, k.summary);
  for (const view::NamedShading& s : view::shadings()) shadings += fmt::format("\n  {:<12} {}", s.name, s.summary);
  for (const HeatKind& h : kHeatKinds) heats += fmt::format("\n  {:<12} {}", h.name, h.what);
  args->world.add_to(*cmd, true);
  cmd->remove_option(cmd->get_option("--json"));
  args->query.add_to(*cmd);
  cmd->add_option("--rays", args->session.settings.rays, "ray kind to trace and show [primary]" + kinds);
  cmd->add_option("--shading", args->session.settings.shading, "what to draw [eyelight]" + shadings);
  cmd->add_option("--heat", args->session.settings.heat, "counter that --shading heat shows [nodes]" + heats);
  args->light.add_to(*cmd);
  cmd->add_option("--view", args->session.view,
                  "name of the camera to start with [the place where the last session of this scene ended]");
  cmd->add_option("--views-file", args->session.views_file,
                  "JSON file of views: they are listed after the scene's own, and key V appends one\n"
                  "[SCENE-views.json in --out]");
  cmd->add_option("--size", args->size, "WIDTHxHEIGHT of the window, in screen units [1280x720]");
  cmd->add_option("--spp", args->session.settings.samples,
                  "samples per pixel that are accumulated while the camera rests, 1 to 65536 [64]");
  cmd->add_option("--target", args->target_ms,
                  "target time of a frame while the camera moves, in milliseconds, at most 10000 [50 on a CPU, 8 on a "
                  "GPU]");
  cmd->add_flag("--no-scale", args->no_scale,
                "trace every pixel while the camera moves; by default fewer are traced to meet --target");
  cmd->add_option("--out", args->session.out, "folder for pictures and views [.]");
  cmd->add_option("--frames", args->session.frames,
                  "turns the camera for so many frames, prints the mean times of the last 240, and quits");
  cmd->footer(
      "Keys: W A S D E Q fly, Shift faster, right button looks, left button orbits and picks, 1 to 9 views, H help.");
  show_first(*cmd, {"--method", "--rays", "--shading", "--heat", "--view", "--size", "--spp", "--device", "--out"});
  cmd->callback([args, &result] { result = run_view(*args); });
}

}  // namespace ballot::cli
