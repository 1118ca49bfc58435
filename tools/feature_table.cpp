#include "tools/feature_table.h"

#include <algorithm>
#include <chrono>
#include <optional>

#include "tools/bench/document.h"

namespace ballot::cli {

namespace {

constexpr std::uint32_t kMeasuredSamples = 8;
constexpr int kLeastRepeats = 5, kMostRepeats = 25;  // bounds on the number of repeats
constexpr double kSecondsOfRepeats = 4;              // no repeat starts later than this, except the first kLeastRepeats
constexpr double kWarmSeconds = 0.03;  // of work on a GPU before each measurement: its clocks fall while the host works

struct NamedFeature {
  bool SceneFeatures::*has;
  const char* words;
};
constexpr NamedFeature kMayHave[] = {
    {&SceneFeatures::shading_normals, "shading normals"},
    {&SceneFeatures::reflects, "mirrors"},
    {&SceneFeatures::refracts, "glass"},
    {&SceneFeatures::emits, "emission"},
    {&SceneFeatures::glossy, "gloss"},
    {&SceneFeatures::unlit, "unlit"},
    {&SceneFeatures::alpha, "alpha"},
    {&SceneFeatures::vertex_colors, "colours of vertices"},
    {&SceneFeatures::base_texture, "colour textures"},
    {&SceneFeatures::surface_texture, "roughness textures"},
    {&SceneFeatures::emissive_texture, "emission textures"},
    {&SceneFeatures::normal_texture, "normal maps"},
    {&SceneFeatures::lights, "punctual lights"},
    {&SceneFeatures::sky, "sky"},
};

/// A shading or an integrator, and the kernels that it runs.
struct Picture {
  std::string_view name;
  const Integrator* integrator = nullptr;  // null: a shading
  std::vector<KernelSource> kernels = {};
  KernelSource every = {};  // the kernel that evaluates hits, compiled for every feature
  const char* pass() const { return integrator ? "scatter" : "shade"; }  // the pass of that kernel
};

std::vector<Picture> shadings_of(const Engine& engine) {
  const bool makes_rays = engine.tracer().makes_rays();
  std::vector<Picture> all;
  for (const Shading& s : kShadings)
    if (!s.heat)
      all.push_back({.name = s.name,
                     .kernels = kernels_of(s, engine.features(), makes_rays),
                     .every = samples_source(s.name, SceneFeatures::every(), makes_rays)});
  return all;
}

std::vector<Picture> integrators_of(const Engine& engine) {
  const bool makes_rays = engine.tracer().makes_rays();
  std::vector<Picture> all;
  for (const Integrator& i : kIntegrators)
    all.push_back({.name = i.name,
                   .integrator = &i,
                   .kernels = kernels_of(i, engine.features(), engine.scene().sky.kind, makes_rays),
                   .every = scatter_source(i, SceneFeatures::every(), Sky::Kind::Gradient, makes_rays)});
  return all;
}

/// The device times, in milliseconds, of all passes and of the pass that evaluates hits.
struct Measured {
  double all = 0, look = 0;
};

/// Returns the width and height of the measured picture, in pixels: enough to keep the device busy.
std::uint32_t measured_size(const Engine& engine) { return engine.device().is_cpu() ? 128 : 1024; }

using Clock = std::chrono::steady_clock;

/// Keeps a GPU busy until its clocks have risen.
class Warmer {
 public:
  explicit Warmer(Engine& engine) : engine_(engine) {
    if (engine.device().is_cpu()) return;
    batch_ = engine.make_batch(engine.scene().views[0], find_ray_kind(kPrimaryRays), 1024, 1024);
    warm();  // compiles the kernel and, for method auto, calibrates
  }
  void warm() const {
    const auto start = Clock::now();
    while (batch_ && std::chrono::duration<double>(Clock::now() - start).count() < kWarmSeconds)
      engine_.trace(*batch_, {});
  }

 private:
  Engine& engine_;
  std::unique_ptr<RayBatch> batch_;  // null: nothing to warm
};

Measured measure(Engine& engine, const Warmer& warmer, const Picture& picture, bool every_feature) {
  warmer.warm();
  const RenderOptions options{.width = measured_size(engine),
                              .height = measured_size(engine),
                              .spp = kMeasuredSamples,
                              .shading = std::string(picture.name),
                              .every_feature = every_feature};
  RenderTimes times;
  engine.render(engine.scene().views[0], options, &times);
  if (picture.integrator) return {times.passes.ms(""), times.passes.ms("scatter")};
  return {times.generate_ms + times.trace_ms + times.shade_ms + times.passes.ms(""), times.shade_ms};
}

template <class Round>
void repeat(const Round& round) {
  const auto end = Clock::now() + std::chrono::duration<double>(kSecondsOfRepeats);
  for (int i = 0; i < kMostRepeats && (i < kLeastRepeats || Clock::now() < end); ++i) round();
}

double median(const std::vector<double>& values) { return bench::quantile(values, 0.5); }

nlohmann::json print_gain(Engine& engine, const Warmer& warmer, const Picture& picture) {
  std::vector<double> own, every, own_look, every_look;
  measure(engine, warmer, picture, false);  // compiles
  measure(engine, warmer, picture, true);
  repeat([&] {
    const Measured a = measure(engine, warmer, picture, false), b = measure(engine, warmer, picture, true);
    own.push_back(a.all);
    every.push_back(b.all);
    own_look.push_back(a.look);
    every_look.push_back(b.look);
  });
  const nlohmann::json json{{"ms", median(own)},
                            {"every_feature_ms", median(every)},
                            {fmt::format("{}_ms", picture.pass()), median(own_look)},
                            {fmt::format("every_feature_{}_ms", picture.pass()), median(every_look)}};
  say("    {:.1f} ms, {:.1f} ms with every feature: {:.2f} times as fast; {} {:.1f} and {:.1f} ms: {:.2f}\n",
      median(own), median(every), median(every) / median(own), picture.pass(), median(own_look), median(every_look),
      median(every_look) / median(own_look));
  return json;
}

nlohmann::json print_kernel(Engine& engine, const KernelSource& source) {
  const Kernel kernel(*engine.context(), source);
  const KernelTimes& t = kernel.times();
  say("    {:<60} {:>7} bytes  SPIR-V {:.1f} ms{}  pipeline {:.1f} ms\n", source.name, t.spirv_bytes, t.spirv_ms,
      t.from_cache ? " (cached)" : "", t.pipeline_ms);
  nlohmann::json figures = nlohmann::json::object();
  for (const PipelineFigure& f : kernel.statistics()) {
    say("      {}: {}\n", f.name, f.value);
    figures[f.name] = f.value;
  }
  return {{"name", source.name},          {"spirv_bytes", t.spirv_bytes}, {"spirv_ms", t.spirv_ms},
          {"spirv_cached", t.from_cache}, {"pipeline_ms", t.pipeline_ms}, {"statistics", figures}};
}

/// Prints the kernels of each picture. A warmer asks for measurements too; null: none.
nlohmann::json print_pictures(Engine& engine, const std::vector<Picture>& pictures, const char* word,
                              const Warmer* warmer) {
  nlohmann::json json = nlohmann::json::array();
  for (const Picture& picture : pictures) {
    say("  {}\n", picture.name);
    nlohmann::json kernels = nlohmann::json::array();
    for (const KernelSource& source : picture.kernels) kernels.push_back(print_kernel(engine, source));
    const std::size_t every =
        compile_shader(picture.every.file, defines_of(picture.every, engine.device())).words.size() * 4;
    say("    {:<60} {:>7} bytes\n", fmt::format("({} with every feature)", picture.pass()), every);
    json.push_back({{word, picture.name}, {"kernels", kernels}, {"every_feature_spirv_bytes", every}});
    if (warmer) json.back()["gain"] = print_gain(engine, *warmer, picture);
  }
  return json;
}

/// Traces rays of a kind by the engine's tracer, whose stacks fit this tree, and by `common`, whose stacks have the
/// size for every feature. Prints and returns both times; null if there are no such rays.
nlohmann::json print_stack_gain(Engine& engine, Tracer& common, const RayKind& kind) {
  const auto batch =
      engine.make_batch(engine.scene().views[0], kind, 2 * measured_size(engine), 2 * measured_size(engine));
  if (batch->count() == 0) return nullptr;
  const Query query = engine.resolve(*batch, Query{});
  Buffer<Ray> rays(*engine.context(), batch->count(), Access::Storage, "rays");
  Buffer<Hit> hits(*engine.context(), batch->count(), Access::Storage, "hits");
  rays.upload(batch->rays());
  const auto traced = [&](Tracer& tracer) {
    return tracer.trace(rays, hits, std::uint32_t(batch->count()), query).device_ms;
  };
  std::vector<double> own{traced(engine.tracer())}, other{traced(common)};  // the first traces compile
  own.clear(), other.clear();
  repeat([&] {
    own.push_back(traced(engine.tracer()));
    other.push_back(traced(common));
  });
  say("    {} rays by {}: {:.2f} and {:.2f} ms, {:.2f} times as fast\n", kind.name, query.method, median(own),
      median(other), median(other) / median(own));
  return {{"rays", kind.name}, {"method", query.method}, {"ms", median(own)}, {"every_feature_ms", median(other)}};
}

nlohmann::json print_traversal(Engine& engine, bool measured) {
  const TreeFacts tree = engine.features().tree;
  TreeFacts common = SceneFeatures::every().tree;
  common.depth = std::max(common.depth, tree.depth);
  common.far = tree.far;
  say("\ntraversal: stacks of {} entries for a tree of depth {}{}{}; {} with every feature\n", stack_entries(tree),
      tree.depth, leaves_loop(tree) ? "" : ", no loop over the one triangle of a leaf",
      tree.far ? ", boxes relative to the middle of the scene" : "", stack_entries(common));
  nlohmann::json json{{"stack_entries", stack_entries(tree)},
                      {"every_feature_stack_entries", stack_entries(common)},
                      {"leaf_loop", leaves_loop(tree)}};
  if (!measured || engine.forest()) return json;
  json["gain"] = nlohmann::json::array();
  if (stack_entries(tree) == stack_entries(common) && leaves_loop(tree)) {
    say("    the kernels for this scene and for every feature are the same\n");
    return json;
  }
  Tracer tracer(*engine.context(), engine.bvh(), engine.scene().triangles, common);
  for (const char* kind : {"primary", "diffuse"})
    if (nlohmann::json gain = print_stack_gain(engine, tracer, find_ray_kind(kind)); !gain.is_null())
      json["gain"].push_back(std::move(gain));
  return json;
}

}  // namespace

std::string feature_words(const SceneFeatures& features) {
  std::string words;
  for (const NamedFeature& f : kMayHave)
    if (features.*f.has) words += fmt::format("{}{}", words.empty() ? "" : ", ", f.words);
  return words.empty() ? "nothing beyond plain triangles" : words;
}

std::string camera_words(const SceneFeatures& features) {
  if (features.perspective && features.orthographic) return "perspective, orthographic";
  return features.orthographic ? "orthographic" : "perspective";
}

nlohmann::json features_json(const SceneFeatures& features) {
  nlohmann::json holds = nlohmann::json::array(), cameras = nlohmann::json::array();
  for (const NamedFeature& f : kMayHave)
    if (features.*f.has) holds.push_back(f.words);
  if (features.perspective) cameras.push_back("perspective");
  if (features.orthographic) cameras.push_back("orthographic");
  return {{"holds", holds},
          {"cameras", cameras},
          {"tree_depth", features.tree.depth},
          {"largest_leaf", features.tree.largest_leaf},
          {"far", features.tree.far}};
}

nlohmann::json print_features(Engine& engine, bool measured) {
  nlohmann::json json{{"features", features_json(engine.features())}};
  json["traversal"] = print_traversal(engine, measured);
  std::optional<Warmer> warm;
  if (measured) warm.emplace(engine);
  const Warmer* warmer = warm ? &*warm : nullptr;
  say("\nshadings and the kernels that each one runs on this scene, without those of the traversal:\n");
  json["shadings"] = print_pictures(engine, shadings_of(engine), "shading", warmer);
  say("\nintegrators and the kernels that each one runs on this scene, without those of the traversal:\n");
  json["integrators"] = print_pictures(engine, integrators_of(engine), "integrator", warmer);
  if (measured)
    say("  device times of view {}, {} x {} pixels, {} samples: medians of {} to {} repeats, both kinds in turn\n",
        engine.scene().views[0].name, measured_size(engine), measured_size(engine), kMeasuredSamples, kLeastRepeats,
        kMostRepeats);
  return json;
}

}  // namespace ballot::cli
