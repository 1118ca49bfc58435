#include "tools/feature_table.h"

#include <algorithm>

namespace ballot::cli {

namespace {

constexpr std::uint32_t kMeasuredSamples = 8;
constexpr int kRepeats = 5;

struct NamedFeature {
  bool SceneFeatures::*has;
  const char* words;
};
constexpr NamedFeature kFeatures[] = {
    {&SceneFeatures::shading_normals, "shading normals"},
    {&SceneFeatures::reflects, "mirrors"},
    {&SceneFeatures::refracts, "glass"},
    {&SceneFeatures::emits, "emission"},
    {&SceneFeatures::glossy, "gloss"},
    {&SceneFeatures::unlit, "unlit"},
    {&SceneFeatures::alpha, "alpha"},
    {&SceneFeatures::base_texture, "colour textures"},
    {&SceneFeatures::surface_texture, "roughness textures"},
    {&SceneFeatures::emissive_texture, "emission textures"},
    {&SceneFeatures::normal_texture, "normal maps"},
    {&SceneFeatures::lights, "punctual lights"},
    {&SceneFeatures::sky, "sky"},
};

std::vector<KernelSource> kernels_of(const Integrator& integrator, const Scene& scene) {
  const SceneFeatures f = features_of(scene);
  const WavePlan plan = plan_of(integrator, f);
  std::vector<KernelSource> sources{begin_source(), scatter_source(integrator, f, scene.sky.kind)};
  if (plan.alpha) sources.push_back(alpha_source(f));
  if (plan.shadow) sources.push_back(connect_source());
  sources.push_back(film_source(false));
  return sources;
}

/// Device milliseconds of all passes, and of the scattering alone.
struct Measured {
  double all = 0, scatter = 0;
};

/// Pixels a side, enough to keep the device busy.
std::uint32_t measured_size(Engine& engine) { return engine.device().is_cpu() ? 128 : 1024; }

Measured measure(Engine& engine, const Integrator& integrator, bool every_feature) {
  const RenderOptions options{.width = measured_size(engine),
                              .height = measured_size(engine),
                              .spp = kMeasuredSamples,
                              .shading = std::string(integrator.name),
                              .every_feature = every_feature};
  RenderTimes times;
  engine.render(engine.scene().views[0], options, &times);
  return {times.passes.ms(""), times.passes.ms("scatter")};
}

double median(std::vector<double> values) {
  std::ranges::sort(values);
  return values[values.size() / 2];
}

nlohmann::json print_gain(Engine& engine, const Integrator& integrator) {
  std::vector<double> own, every, own_scatter, every_scatter;
  measure(engine, integrator, false);  // compiles
  measure(engine, integrator, true);
  for (int i = 0; i < kRepeats; ++i) {
    const Measured a = measure(engine, integrator, false), b = measure(engine, integrator, true);
    own.push_back(a.all);
    every.push_back(b.all);
    own_scatter.push_back(a.scatter);
    every_scatter.push_back(b.scatter);
  }
  const nlohmann::json json{{"ms", median(own)},
                            {"every_feature_ms", median(every)},
                            {"scatter_ms", median(own_scatter)},
                            {"every_feature_scatter_ms", median(every_scatter)}};
  fmt::print(
      "    {:.1f} ms, {:.1f} ms with every feature: {:.2f} times as fast; scatter {:.1f} and {:.1f} ms: {:.2f}\n",
      median(own), median(every), median(every) / median(own), median(own_scatter), median(every_scatter),
      median(every_scatter) / median(own_scatter));
  return json;
}

}  // namespace

std::string feature_words(const SceneFeatures& features) {
  std::string words;
  for (const NamedFeature& f : kFeatures)
    if (features.*f.has) words += fmt::format("{}{}", words.empty() ? "" : ", ", f.words);
  return words.empty() ? "nothing beyond plain triangles" : words;
}

nlohmann::json print_features(Engine& engine, bool measured) {
  const Scene& scene = engine.scene();
  nlohmann::json json = nlohmann::json::array();
  fmt::print("\nintegrators, and the kernels that this scene needs (those of the traversal besides):\n");
  for (const Integrator& integrator : kIntegrators) {
    const Spirv every = compile_shader("path/scatter.comp",
                                       scatter_source(integrator, SceneFeatures::every(), Sky::Kind::Gradient).defines);
    fmt::print("  {}\n", integrator.name);
    nlohmann::json kernels = nlohmann::json::array();
    for (const KernelSource& source : kernels_of(integrator, scene)) {
      const Kernel kernel(*engine.context(), source);
      const KernelTimes& t = kernel.times();
      fmt::print("    {:<60} {:>7} bytes  SPIR-V {:.1f} ms{}  pipeline {:.1f} ms\n", source.name, t.spirv_bytes,
                 t.spirv_ms, t.from_cache ? " (cached)" : "", t.pipeline_ms);
      nlohmann::json figures = nlohmann::json::object();
      for (const PipelineFigure& f : kernel.statistics()) {
        fmt::print("      {}: {}\n", f.name, f.value);
        figures[f.name] = f.value;
      }
      kernels.push_back({{"name", source.name},
                         {"spirv_bytes", t.spirv_bytes},
                         {"spirv_ms", t.spirv_ms},
                         {"spirv_cached", t.from_cache},
                         {"pipeline_ms", t.pipeline_ms},
                         {"statistics", figures}});
    }
    fmt::print("    {:<60} {:>7} bytes\n", "(scatter with every feature)", every.words.size() * 4);
    json.push_back(
        {{"integrator", integrator.name}, {"kernels", kernels}, {"every_feature_spirv_bytes", every.words.size() * 4}});
    if (measured) json.back()["gain"] = print_gain(engine, integrator);
  }
  if (measured)
    fmt::print("  device times of view {}, {} x {}, {} samples, median of {}, both in turn\n", scene.views[0].name,
               measured_size(engine), measured_size(engine), kMeasuredSamples, kRepeats);
  return json;
}

}  // namespace ballot::cli
