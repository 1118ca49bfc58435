#include "tools/program/run_args.h"

#include "tools/program/picture_size.h"

namespace ballot::cli {

namespace {

std::string kinds_text() {
  std::string text;
  for (const RayKind& kind : kRayKinds) text += fmt::format("\n  {:<14} {}", kind.name, kind.summary);
  return text + fmt::format("\n  {:<14} {}", "FILE.npy",
                            "your own rays in the format of 'ballot trace'; FILE.npy:any asks for any hit;\n"
                            "                 NAME=FILE.npy: files that share a NAME are the views of one set of rays");
}

std::string offsets_text() {
  std::string text;
  for (const OffsetPolicy& policy : kOffsetPolicies) text += fmt::format("\n  {:<14} {}", policy.name, policy.summary);
  return text;
}

}  // namespace

std::string methods_text() {
  std::string text;
  for (const Method& m : kMethods) {
    std::string takes;
    for (const std::string& vote : bench::votes_of(m)) takes += (takes.empty() ? "vote=" : "|") + vote;
    if (m.threshold.unit != Threshold::None)
      takes += fmt::format("{}{}={:g}", takes.empty() ? "" : ", ", m.threshold.knob, m.threshold.standard);
    text += fmt::format("\n  {:<14} {}{}", m.name, m.summary, takes.empty() ? "" : " [" + takes + "]");
  }
  return text;
}

nlohmann::json device_header(const char* kind, const DeviceInfo& device) {
  return {{"kind", kind},
          {"device", device.name},
          {"driver", device.driver},
          {"subgroup_size", device.subgroup_size},
          {"commit", commit()},
          {"command", command_line()},
          {"records", nlohmann::json::array()}};
}

void RunArgs::add_options(CLI::App& cmd) {
  std::string modes;
  for (const NumericMode& m : kNumericModes) modes += fmt::format("\n  {:<14} {}", m.name, m.summary);
  cmd.add_option("SCENE", scenes, "scene files");
  cmd.add_option("--methods", plan.methods,
                 fmt::format("comma-separated list of METHOD or METHOD:KNOB=VALUE:..., or 'all'. A method without a "
                             "vote is\nmeasured with every vote that it takes; e.g. packet:vote=sum,if-if [{}]{}",
                             plan.methods, methods_text()));
  cmd.add_option("--rays", plan.rays,
                 fmt::format("comma-separated list of ray kinds and files, or 'all' [{}]{}", plan.rays, kinds_text()));
  cmd.add_option("--numeric", plan.numeric,
                 fmt::format("comma-separated list of numeric modes, or 'all' [{}]{}", plan.numeric, modes));
  cmd.add_option("--knob", plan.knobs,
                 "NAME=VALUE: sets a tuning parameter of every method that has it; may be repeated" + knob_list())
      ->take_all();
  cmd.add_option("--views", plan.views, "comma-separated list of cameras of the scenes, or 'all' [all]");
  cmd.add_option("--views-file", plan.views_file,
                 "JSON file whose views replace the scenes' own; key V of 'ballot view' writes one");
  cmd.add_option("--size", size, "WIDTHxHEIGHT of the picture in pixels [1024x1024 on a GPU, 256x256 on a CPU]");
  cmd.add_option("--repeat", run.repeats,
                 "measurements of each method, 1 to 10000 [20]. The methods are interleaved, in another random order\n"
                 "each time; the orders come from a fixed seed");
  cmd.add_option("--ao-rays", run.kinds.ao_rays, "rays per hit of ray kind ao, 1 to 64 [8]");
  cmd.add_option("--ao-radius", run.kinds.ao_radius,
                 "length of the rays of kind ao, as a share of the scene's diagonal [0.05]");
  cmd.add_option("--offset", run.kinds.offset,
                 fmt::format("origin offset policy: how far from the surface secondary rays start [{}]{}",
                             kDefaultOffset, offsets_text()));
  cmd.add_flag("--sweep", plan.sweep,
               "first try several values of each method's threshold; then also measure METHOD(best), the method with "
               "the\nfastest one");
  world.add_options(cmd);
}

void RunArgs::note_files() {
  for (const std::string& scene : scenes) world.files.reads("SCENE", scene);
  world.note_files();
}

void RunArgs::save(const bench::Document& document) const {
  if (!document.partial || !descriptor_of(world.json)) write_json(world.json, bench::to_json(document));
}

bench::RunOptions RunArgs::options() const {
  bench::RunOptions checked = run;
  checked.world = world.options();
  checked.command = command_line();
  if (checked.repeats < 1 || checked.repeats > 10000)
    fail(Failure::Arguments, "--repeat: {} is not between 1 and 10000", checked.repeats);
  check_options(checked.kinds);
  if (!size.empty()) {
    parse_size(size, checked.width, checked.height);
    check_options(RenderOptions{.width = checked.width, .height = checked.height});
  }
  return checked;
}

bench::Plan RunArgs::make_plan() const {
  bench::Plan made = bench::make_plan(plan);
  if (plan.sweep && made.sweeps.empty())
    say_aside("ballot: note: --sweep has no effect: none of the methods has a threshold\n");
  const auto devices = list_devices();
  const DeviceInfo& device = devices[choose_device(devices, world.device)];
  for (const Query& query : made.queries())
    kernel_config_for(find_method(query.method), find_numeric(query.numeric), device, query.knobs);
  return made;
}

}  // namespace ballot::cli
