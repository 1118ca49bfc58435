#include "tools/info/feature_table.h"

namespace ballot::cli {

namespace {

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

/// Returns the names of what a scene holds beside triangles and plain materials.
std::vector<std::string_view> held_by(const SceneFeatures& features) {
  std::vector<std::string_view> held;
  for (const ShapeInfo& s : kShapes)
    if (s.kind != ShapeKind::Triangles && (features.tree.shapes >> std::uint32_t(s.kind) & 1)) held.push_back(s.name);
  for (const NamedFeature& f : kMayHave)
    if (features.*f.has) held.push_back(f.words);
  return held;
}

/// A shading or an integrator, and the kernels that it runs.
struct Picture {
  std::string_view name;
  std::vector<KernelSource> kernels;
};

std::vector<Picture> shadings_of(const DeviceScene& world) {
  std::vector<Picture> all;
  for (const Shading& s : kShadings)
    if (!s.heat) all.push_back({s.name, kernels_of(s, world.features(), world.tracer().makes_rays())});
  return all;
}

std::vector<Picture> integrators_of(const DeviceScene& world) {
  std::vector<Picture> all;
  for (const Integrator& i : kIntegrators)
    all.push_back({i.name, kernels_of(i, world.features(), world.scene().sky.kind, world.tracer().makes_rays())});
  return all;
}

nlohmann::json print_kernel(DeviceScene& world, const KernelSource& source) {
  const Kernel kernel(*world.context(), source);
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

nlohmann::json print_pictures(DeviceScene& world, const std::vector<Picture>& pictures, const char* word) {
  nlohmann::json json = nlohmann::json::array();
  for (const Picture& picture : pictures) {
    say("  {}\n", picture.name);
    nlohmann::json kernels = nlohmann::json::array();
    for (const KernelSource& source : picture.kernels) kernels.push_back(print_kernel(world, source));
    json.push_back({{word, picture.name}, {"kernels", kernels}});
  }
  return json;
}

nlohmann::json print_traversal(const DeviceScene& world) {
  const TreeFacts tree = world.features().tree;
  say("\ntraversal: stacks of {} entries for a tree of depth {}{}{}\n", stack_entries(tree), tree.depth,
      leaves_loop(tree) ? "" : ", no loop over the one triangle of a leaf",
      tree.far ? ", boxes relative to the middle of the scene" : "");
  return {{"stack_entries", stack_entries(tree)}, {"leaf_loop", leaves_loop(tree)}};
}

}  // namespace

std::string feature_words(const SceneFeatures& features) {
  const std::vector<std::string_view> held = held_by(features);
  return held.empty() ? "nothing beyond plain triangles" : fmt::format("{}", fmt::join(held, ", "));
}

std::string camera_words(const SceneFeatures& features) {
  if (features.perspective && features.orthographic) return "perspective, orthographic";
  return features.orthographic ? "orthographic" : "perspective";
}

nlohmann::json features_json(const SceneFeatures& features) {
  nlohmann::json holds = held_by(features), cameras = nlohmann::json::array();
  if (features.perspective) cameras.push_back("perspective");
  if (features.orthographic) cameras.push_back("orthographic");
  return {{"holds", holds},
          {"cameras", cameras},
          {"tree_depth", features.tree.depth},
          {"largest_leaf", features.tree.largest_leaf},
          {"far", features.tree.far}};
}

nlohmann::json print_features(DeviceScene& world) {
  nlohmann::json json{{"features", features_json(world.features())}};
  json["traversal"] = print_traversal(world);
  say("\nshadings and the kernels that each one runs on this scene, without those of the traversal:\n");
  json["shadings"] = print_pictures(world, shadings_of(world), "shading");
  say("\nintegrators and the kernels that each one runs on this scene, without those of the traversal:\n");
  json["integrators"] = print_pictures(world, integrators_of(world), "integrator");
  return json;
}

}  // namespace ballot::cli
