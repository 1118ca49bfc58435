#include "tools/bench/markdown.h"
#include "tools/info/device_table.h"
#include "tools/info/feature_table.h"
#include "tools/info/mesh_table.h"
#include "tools/program/help.h"
#include "tools/render/light.h"

namespace ballot::cli {

namespace {

struct InfoArgs {
  SceneArgs world;
  LightArgs light;
  std::string triangles, numeric{kDefaultNumeric};
  bool statistics = false;
};

void print_scene(const Scene& s, const SceneFeatures& f, double load_s) {
  say("\nscene {}: {}, {} materials, {} views, loaded in {:.3f} s\n", s.name, pieces_text(s), s.materials.size(),
      s.views.size(), load_s);
  if (s.instanced())
    say("  {} instances of {} meshes, which are kept once: {} {}\n", s.instances.placements.size(),
        s.instances.meshes(), s.triangles.size(), s.shapes.empty() ? "triangles" : "triangles or shapes");
  say("  bounds ({:.6g}, {:.6g}, {:.6g}) to ({:.6g}, {:.6g}, {:.6g})\n", s.bounds.lo.x, s.bounds.lo.y, s.bounds.lo.z,
      s.bounds.hi.x, s.bounds.hi.y, s.bounds.hi.z);
  if (s.origin != glm::dvec3(0))
    say("  counted from the origin ({:.12g}, {:.12g}, {:.12g})\n", s.origin.x, s.origin.y, s.origin.z);
  std::string views;
  for (const View& v : s.views) views += (views.empty() ? "" : ", ") + v.name;
  say("  views: {}\n  cameras: {}\n  holds: {}\n", views, camera_words(f), feature_words(f));
}

/// Prints the animations of a scene, if it has any. Returns them as JSON.
nlohmann::json print_animations(const Scene& scene) {
  nlohmann::json json = nlohmann::json::array();
  if (!scene.animation) return json;
  const Animation& a = *scene.animation;
  std::size_t triangles = 0;
  for (const MovingPart& part : a.parts) triangles += a.vertices.meshes[part.mesh].triangles;
  for (const MovingPlacement& p : a.placements)
    triangles += scene.instances.triangles_of(scene.instances.placements[p.placement].mesh);
  say("\nanimations, which --animation, --time and --frames of 'ballot render' choose; {} triangles move:\n",
      triangles);
  bench::Table table({"animation", "seconds", "channels"}, 1);
  for (const AnimationClip& c : a.clips) {
    table.row({c.name, fmt::format("{:g}", c.seconds), std::to_string(c.channels.size())});
    json.push_back({{"name", c.name}, {"seconds", c.seconds}, {"channels", c.channels.size()}});
  }
  say("{}", table.text());
  return json;
}

/// Prints the figures of the tree; those of all meshes together, if they are kept once.
void print_bvh(const BvhStats& s, bool kept) {
  say("\nBVH: {} nodes ({} leaves of at most {} triangles), depth {}, {}{} by '{}' in {:.3f} s\n", s.nodes, s.leaves,
      s.largest_leaf, s.depth, kept ? "" : fmt::format("SAH cost {:.2f}, ", s.sah),
      s.from_cache ? "from the cache, built" : "built", builder_of(s.builder).name, s.build_s);
  say("  {} references to {} triangles ({:+.1f} % by spatial splits); {} of zero area left out\n", s.references,
      s.triangles, s.triangles > s.degenerate ? 100.0 * s.references / (s.triangles - s.degenerate) - 100 : 0.0,
      s.degenerate);
  say("  {:.2f} MiB, {:.1f} bytes a triangle\n", double(s.bytes) / (1 << 20),
      s.triangles ? double(s.bytes) / s.triangles : 0.0);
}

/// Prints the pipeline statistics that the driver reports for every method's kernels, such as registers and stack.
nlohmann::json print_statistics(DeviceScene& world, const std::string& numeric) {
  if (!world.device().pipeline_statistics) {
    say("\nno pipeline statistics: {} does not report them (VK_KHR_pipeline_executable_properties)\n",
        world.device().driver);
    return nlohmann::json::array();
  }
  say("\npipeline statistics that the driver reports, numeric mode {}:\n\n", numeric);
  nlohmann::json json = nlohmann::json::array();
  bench::Table table({"kernel", "statistics"}, 2);
  for (const Method& m : kMethods)
    for (const Want want : {Want::Nearest, Want::Any}) {
      if (m.chooses) continue;
      const Kernel& kernel = world.tracer().kernel({.want = want, .method = std::string(m.name), .numeric = numeric});
      std::string figures;
      nlohmann::json values;
      for (const PipelineFigure& f : kernel.statistics()) {
        figures += fmt::format("{}{} {:g}", figures.empty() ? "" : ", ", f.name, f.value);
        values[f.name] = f.value;
      }
      table.row({kernel.name().substr(0, kernel.name().find(" [")), figures});
      json.push_back({{"kernel", kernel.name()}, {"figures", values}});
    }
  say("{}", table.text());
  return json;
}

nlohmann::json print_variants(const DeviceInfo& device, const TreeFacts& tree) {
  say("\nkernel of each method on this device, closest hit; --method and --knob choose others:\n");
  nlohmann::json json = nlohmann::json::array();
  for (const Method& m : kMethods) {
    if (m.chooses) continue;
    const NumericMode& numeric = find_numeric(kDefaultNumeric);
    const Variant v{&m, &numeric, Want::Nearest, kernel_config_for(m, numeric, device)};
    kernel_source(v, device, tree);  // throws if the device cannot run it
    say("  {}\n", v.name());
    json.push_back(v.name());
  }
  return json;
}

/// Prints what method auto takes in this scene, by ray class and size of the batch.
nlohmann::json print_auto(const Tracer& tracer, const std::string& numeric) {
  say("\nmethod auto takes, by the size of the batch; \"(any)\": any hit, else the closest one:\n\n");
  nlohmann::json json = nlohmann::json::array();
  bench::Table table({"rays", "1000", "10^4", "10^5", "10^6"}, 5);
  for (const RayKind& kind : kRayKinds) {
    std::vector<std::string> row{std::string(kind.name) + (kind.want == Want::Any ? " (any)" : "")};
    for (const std::size_t rays : {1000, 10'000, 100'000, 1'000'000}) {
      const Query query = tracer.resolve(
          {.want = kind.want, .method = std::string(kAuto), .numeric = numeric, .rays = std::string(kind.name)}, rays);
      row.push_back(Candidate{query.method, query.knobs}.name());
      json.push_back({{"rays", kind.name}, {"count", rays}, {"method", query.method}, {"knobs", query.knobs}});
    }
    table.row(std::move(row));
  }
  say("{}", table.text());
  return json;
}

int run_info(InfoArgs& args) {
  nlohmann::json json;
  if (!args.triangles.empty() && args.world.scene.empty())
    fail(Failure::Arguments, "--triangles needs a SCENE: ballot info SCENE --triangles T.npy");
  for (const auto& [given, option] :
       {std::pair(args.statistics, "--statistics"), std::pair(args.light.sky != "auto", "--sky"),
        std::pair(!args.light.lamps.empty(), "--lamp")})
    if (given && args.world.scene.empty())
      fail(Failure::Arguments, "{} needs a SCENE: ballot info SCENE {}", option, option);
  find_numeric(args.numeric);
  args.world.note_files();
  args.triangles = args.world.files.writes("--triangles", args.triangles).string();
  json["devices"] = print_devices(args.world.device);
  int code = 0;
  if (!args.world.scene.empty()) {
    Opened opened = open_scene(
        args.world, {}, [&](Scene& s) { args.light.apply(s, {&s.views[0]}, ""); }, args.statistics);
    print_scene(opened.world->scene(), opened.world->features(), opened.load_s);
    json.update(print_meshes(opened.world->scene(), !args.world.json.empty()));
    json["animations"] = print_animations(opened.world->scene());
    print_bvh(opened.world->bvh_stats(), opened.world->forest() != nullptr);
    const nlohmann::json header = record_header(*opened.world, opened.load_s);
    json.update(header);
    json["variants"] = print_variants(opened.world->device(), opened.world->features().tree);
    if (args.statistics) json["statistics"] = print_statistics(*opened.world, args.numeric);
    json["auto"] = print_auto(opened.world->tracer(), args.numeric);
    json.update(print_features(*opened.world));
    if (!args.triangles.empty()) {
      need_triangles(opened.world->scene(), "--triangles");
      const UnsetVector<Triangle> all = world_triangles(opened.world->scene());
      write_triangles(args.triangles, all);
      say("\nwrote {} triangles to {}\n", all.size(), args.triangles);
    }
    code = finish(*opened.world);
  }
  write_json(args.world.json, json);
  return code;
}

}  // namespace

void add_info(CLI::App& app, int& result) {
  const auto [cmd, args] = add_command<InfoArgs>(
      app, result, "info", run_info,
      "lists the Vulkan devices and what they lack; with SCENE also its statistics, BVH and kernels");
  args->world.add_to(*cmd, false);
  cmd->add_option("--triangles", args->triangles,
                  "write the world-space triangles, in the order of their prim numbers, to this .npy file:\n"
                  "float32 (n,3,3), for checks by other programs");
  args->light.add_to(*cmd);
  cmd->add_flag("--statistics", args->statistics,
                "compile every method's kernels and print the statistics that the driver reports, such as registers");
  cmd->add_option("--numeric", args->numeric,
                  fmt::format("numeric mode for --statistics and for what auto takes [{}]", kDefaultNumeric));
  show_first(*cmd, {"--device", "--triangles", "--json"});
}

}  // namespace ballot::cli
