#include <map>
#include <set>
#include <unordered_set>

#include "tools/program/cli.h"

namespace ballot::cli {

namespace {

struct ShadersArgs {
  bool fresh = false;
  std::string json, headers, only;
};

/// Devices that together reach every define of the kernel configurations: compiling needs no driver.
std::vector<DeviceInfo> imagined_devices() {
  DeviceInfo gpu;
  gpu.name = "a GPU";
  gpu.type = VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU;
  gpu.subgroup_size = gpu.min_subgroup_size = gpu.max_subgroup_size = 32;
  gpu.max_group_invocations = gpu.max_group_size_x = 1024;
  gpu.max_group_subgroups = 32;
  gpu.shared_bytes = 32768;
  gpu.uniform_flow = gpu.shuffle = gpu.arithmetic = gpu.buffer_address = gpu.float64 = true;
  DeviceInfo plain = gpu;
  plain.name = "a GPU without options";
  plain.uniform_flow = plain.shuffle = plain.arithmetic = plain.buffer_address = false;
  DeviceInfo cpu = plain;
  cpu.name = "lavapipe";
  cpu.type = VK_PHYSICAL_DEVICE_TYPE_CPU;
  cpu.driver_id = VK_DRIVER_ID_MESA_LLVMPIPE;
  cpu.driver = "llvmpipe Mesa 22.3.6";
  cpu.shuffle = true;
  return {gpu, plain, cpu};
}

std::vector<KernelSource> traversal_sources() {
  std::vector<KernelSource> sources;
  const std::vector<DeviceInfo> devices = imagined_devices();
  for (const Method& method : kMethods) {
    if (method.chooses) continue;
    for (const CoveringKernel& kernel : covering_kernels({.methods = {&method, 1}, .devices = devices})) {
      sources.push_back(kernel.source());
      if (kernel.variant.config.lists())
        sources.push_back(kernel_source(kernel.variant.taking(), *kernel.device, kernel.tree));
    }
  }
  return sources;
}

/// Every integrator with nothing of what a scene may have, each thing alone, and all, also with instances.
std::vector<KernelSource> integrator_sources() {
  constexpr bool SceneFeatures::*kEach[] = {&SceneFeatures::shading_normals, &SceneFeatures::glossy,
                                            &SceneFeatures::emits,           &SceneFeatures::unlit,
                                            &SceneFeatures::vertex_colors,   &SceneFeatures::base_texture,
                                            &SceneFeatures::surface_texture, &SceneFeatures::emissive_texture,
                                            &SceneFeatures::normal_texture,  &SceneFeatures::lights};
  std::vector<KernelSource> sources{indirect_source(),
                                    connect_source(),
                                    film_source(false),
                                    film_source(true),
                                    alpha_source({}),
                                    alpha_source({.base_texture = true}),
                                    alpha_source({.base_texture = true, .tree = {.top_depth = 1}}),
                                    alpha_source({.vertex_colors = true}),
                                    alpha_source({.vertex_colors = true, .base_texture = true, .stored = true})};
  std::set<std::string> names;
  const auto add = [&](const Integrator& integrator, const SceneFeatures& features, Sky::Kind sky) {
    for (const auto& [makes_rays, orthographic] : {std::pair(false, false), {true, false}, {true, true}}) {
      SceneFeatures seen = features;
      seen.perspective = !orthographic;
      seen.orthographic = orthographic;
      KernelSource source = scatter_source(integrator, seen, sky, makes_rays);
      if (names.insert(source.name).second) sources.push_back(std::move(source));
    }
  };
  for (const Integrator& integrator : kIntegrators) {
    add(integrator, {}, Sky::Kind::None);
    SceneFeatures all, glass{.refracts = true, .glossy = true};
    for (const auto feature : kEach) {
      SceneFeatures one;
      one.*feature = all.*feature = true;
      if (feature == &SceneFeatures::emissive_texture) one.emits = true;
      add(integrator, one, Sky::Kind::None);
    }
    all.refracts = true;
    add(integrator, glass, Sky::Kind::None);
    for (const Sky::Kind sky : {Sky::Kind::Constant, Sky::Kind::Gradient, Sky::Kind::Map}) {
      add(integrator, {}, sky);
      add(integrator, all, sky);
    }
    all.tree.top_depth = 1;
    add(integrator, all, Sky::Kind::Map);
    all.tree.top_depth = 0;
    all.stored = true;
    add(integrator, all, Sky::Kind::None);
  }
  return sources;
}

/// Generators, and shadings for scenes with and without normals and emission.
std::vector<KernelSource> render_sources() {
  std::vector<KernelSource> sources;
  for (const auto& [perspective, orthographic] : {std::pair(true, false), {false, true}, {true, true}}) {
    const SceneFeatures cameras{.perspective = perspective, .orthographic = orthographic};
    for (const bool listed : {false, true}) sources.push_back(primary_source(listed, cameras));
  }
  for (const RayKind& kind : kRayKinds)
    if (kind.generators.size() == 1 && !kind.from_camera())
      for (const OffsetPolicy& offset : kOffsetPolicies)
        for (const SceneFeatures& features :
             {SceneFeatures{}, SceneFeatures{.stored = true}, SceneFeatures{.tree = {.top_depth = 1}}})
          sources.push_back(generator_source(kind.generators[0], offset, features));
  for (const Shading& shading : kShadings)
    for (const bool normals : {false, true})
      for (const bool emits : {false, true})
        for (const bool textures : {false, true}) {
          SceneFeatures features;
          features.shading_normals = normals;
          features.emits = emits;
          features.unlit = features.vertex_colors = features.base_texture = features.normal_texture = textures;
          features.emissive_texture = textures && emits;
          sources.push_back(shading_source(shading.name, features));
          SceneFeatures kept = features;
          kept.tree.top_depth = 1;
          sources.push_back(shading_source(shading.name, kept));
          kept = features;
          kept.stored = true;
          for (const auto source : {samples_source, live_source}) sources.push_back(source(shading.name, kept, false));
          for (const auto source : {samples_source, live_source})
            sources.push_back(source(shading.name, features, false));
          for (const bool orthographic : {false, true}) {
            features.perspective = !orthographic;
            features.orthographic = orthographic;
            for (const auto source : {samples_source, live_source})
              sources.push_back(source(shading.name, features, true));
          }
        }
  for (KernelSource& source : integrator_sources()) sources.push_back(std::move(source));
  for (KernelSource& source : live_sources()) sources.push_back(std::move(source));
  sources.push_back(pose_source());
  for (KernelSource& source : posed_triangle_sources()) sources.push_back(std::move(source));
  for (KernelSource& source : indexed_triangle_sources()) sources.push_back(std::move(source));
  const std::size_t count = sources.size();
  for (const DeviceInfo& device : imagined_devices())
    if (device.is_cpu())
      for (std::size_t i = 0; i < count; ++i) {
        sources.push_back(sources[i]);
        sources.back().defines = defines_of(sources[i], device);
      }
  return sources;
}

/// The builder of the device, with and without float64.
std::vector<KernelSource> builder_sources() {
  std::vector<KernelSource> sources;
  for (DeviceInfo device : imagined_devices()) {
    if (!device.shuffle) continue;
    device.float64 = !device.is_cpu();
    for (KernelSource& source : build_sources(device)) sources.push_back(std::move(source));
  }
  return sources;
}

/// The kernels of point and ray queries, of users, and of reordering rays.
std::vector<KernelSource> query_kernel_sources() {
  std::vector<KernelSource> sources;
  for (const DeviceInfo& device : imagined_devices())
    for (KernelSource& source : query_sources(device)) sources.push_back(std::move(source));
  for (const DeviceInfo& device : imagined_devices())
    for (KernelSource& source : user_sources(device)) sources.push_back(std::move(source));
  for (KernelSource& source : reorder_sources()) sources.push_back(std::move(source));
  for (const DeviceInfo& device : imagined_devices())
    for (const bool textures : {false, true})
      for (const bool stored : {false, true})
        for (const std::uint32_t top_depth : {0u, 24u}) {
          const SceneFeatures features{
              .vertex_colors = !textures,
              .base_texture = textures,
              .stored = stored,
              .tree = {.depth = 32, .largest_leaf = MAX_LEAF_TRIANGLES, .top_depth = top_depth}};
          SceneFeatures bent = features;
          bent.shading_normals = true, bent.normal_texture = textures;
          for (KernelSource& source : surface_column_sources(bent)) sources.push_back(std::move(source));
          for (KernelSource& source : alpha_crossing_sources(device, features.tree, look_defines(features, true)))
            sources.push_back(std::move(source));
        }
  return sources;
}

/// Keeps of each file's variants as many as show every two defines with every two values of theirs that occur.
void keep_pairs(std::vector<KernelSource>& sources) {
  std::map<std::string, std::set<std::string>> names;  // of the defines of each file
  for (const KernelSource& s : sources)
    for (const auto& [name, value] : s.defines) names[s.file].insert(name);
  std::map<std::string, std::uint64_t> numbers;  // of each file with each setting of each define
  std::unordered_set<std::uint64_t> seen;
  std::erase_if(sources, [&](const KernelSource& s) {
    const std::map<std::string, int> given(s.defines.begin(), s.defines.end());
    std::vector<std::uint64_t> settings;
    const auto add = [&](const std::string& setting) {
      settings.push_back(numbers.emplace(s.file + ' ' + setting, numbers.size()).first->second);
    };
    add("");  // the file itself, which may have no defines
    for (const std::string& name : names[s.file])
      add(given.contains(name) ? fmt::format("{}={}", name, given.at(name)) : name);
    bool adds = false;
    for (std::size_t i = 0; i < settings.size(); ++i)
      for (std::size_t k = 0; k <= i; ++k) adds |= seen.insert(settings[i] << 32 | settings[k]).second;
    return !adds;
  });
}

int write_headers(const std::filesystem::path& folder) {
  write_file(folder / "knobs.h", knobs_header());
  write_file(folder / "knobs_guard.h", knobs_guard());
  say("{}\n{}\n", (folder / "knobs.h").string(), (folder / "knobs_guard.h").string());
  return 0;
}

int run_shaders(const ShadersArgs& args) {
  if (!args.headers.empty()) return write_headers(args.headers);
  nlohmann::json json = nlohmann::json::array();
  std::vector<KernelSource> sources;
  for (auto* some : {&render_sources, &builder_sources, &query_kernel_sources})
    for (KernelSource& source : (*some)()) sources.push_back(std::move(source));
  keep_pairs(sources);
  for (KernelSource& source : traversal_sources()) sources.push_back(std::move(source));
  std::erase_if(sources, [&](const KernelSource& s) { return s.name.find(args.only) == std::string::npos; });
  if (sources.empty())
    fail(Failure::Arguments,
         "--only {}: no variant's name contains this; `ballot shaders` without --only lists the names", args.only);
  std::vector<Spirv> compiled(sources.size());
  for_chunks(sources.size(), 1, [&](std::size_t i, std::size_t) {
    compiled[i] = compile_shader(sources[i].file, sources[i].defines, !args.fresh, Calls::Kept,
                                 {sources[i].text, "kernel " + sources[i].name});
    reflect(compiled[i].words, sources[i].name);
  });
  double total_ms = 0;
  for (std::size_t i = 0; i < sources.size(); ++i) {
    const std::size_t bytes = compiled[i].words.size() * 4;
    say("{:8.1f} ms {:7} bytes  {}\n", compiled[i].ms, bytes, sources[i].name);
    json.push_back({{"name", sources[i].name}, {"ms", compiled[i].ms}, {"bytes", bytes}});
    total_ms += compiled[i].ms;
  }
  say("{} variants, {:.1f} ms{}\n", sources.size(), total_ms, args.fresh ? "" : " (through the cache)");
  write_json(args.json, json);
  return 0;
}

}  // namespace

void add_shaders(CLI::App& app, int& result) {
  const auto [cmd, args] = add_command<ShadersArgs>(
      app, result, "shaders", run_shaders,
      "compile so many variants of every kernel to SPIR-V that any two settings meet; needs no device");
  cmd->add_flag("--fresh", args->fresh, "compile anew instead of reading the cache");
  cmd->add_option("--only", args->only, "compile only the variants whose names contain this text");
  cmd->add_option("--json", args->json, "also write sizes and times to this file");
  cmd->add_option("--headers", args->headers,
                  "only write the headers that follow from the registry of knobs to this folder: shaders/shared");
}

}  // namespace ballot::cli
