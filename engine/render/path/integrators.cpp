#include "engine/render/path/integrators.h"

#include <algorithm>
#include <iterator>

#include "engine/core/error.h"
#include "engine/core/registry.h"
#include "engine/render/data/camera.h"
#include "engine/render/data/offset_policies.h"

namespace ballot {

namespace {

/// Returns the features that an integrator uses.
SceneFeatures seen_by(const Integrator& integrator, const SceneFeatures& features) {
  if (integrator.sees == Sees::Materials) return features;
  return {.shading_normals = features.shading_normals,
          .stored = features.stored,
          .tree = {.top_depth = features.tree.top_depth, .shapes = features.tree.shapes}};
}

}  // namespace

const Integrator* find_integrator(std::string_view name) { return find_row(kIntegrators, name); }

WavePlan plan_of(const Integrator& integrator, const SceneFeatures& features) {
  WavePlan plan = integrator.plan(features);
  plan.alpha = features.alpha;
  return plan;
}

std::vector<KernelSource> kernels_of(const Integrator& integrator, const SceneFeatures& features, Sky::Kind sky,
                                     bool makes_rays) {
  const WavePlan plan = plan_of(integrator, features);
  std::vector<KernelSource> sources;
  for (const SceneFeatures& seen : by_camera(features)) sources.push_back(primary_source(true, seen));
  for (const SceneFeatures& seen : by_camera(features))  // kernels that read the rays are the same for both
    if (KernelSource scatter = scatter_source(integrator, seen, sky, makes_rays); sources.back().name != scatter.name)
      sources.push_back(std::move(scatter));
  sources.push_back(indirect_source());
  if (plan.alpha) sources.push_back(alpha_source(features));
  if (plan.shadow) sources.push_back(connect_source());
  sources.push_back(film_source(false));
  return sources;
}

KernelSource indirect_source() { return {.name = "path.indirect", .file = "path/indirect.comp", .group_size = QUEUES}; }

KernelSource scatter_source(const Integrator& integrator, const SceneFeatures& features, Sky::Kind sky,
                            bool makes_rays) {
  const bool materials = integrator.sees == Sees::Materials;
  const SceneFeatures seen = seen_by(integrator, features);
  const int kind = materials ? int(sky) : SKY_NONE;
  Defines defines = look_defines(seen, materials);
  defines.emplace_back("BALLOT_HAS_LIGHTS", seen.lights);
  defines.emplace_back("BALLOT_SKY", kind);
  defines.emplace_back("BALLOT_ORIGIN", find_offset_policy(kDefaultOffset).value);
  const bool makes = makes_rays && !features.alpha;
  defines.emplace_back("BALLOT_MAKES_RAYS", makes);
  if (makes) std::ranges::move(camera_defines(features), std::back_inserter(defines));
  constexpr const char* kSkies[] = {"", "+sky", "+gradient", "+skymap"};
  return {.name = fmt::format("{}.scatter{}{}{}{}", integrator.name, look_name(seen, materials),
                              seen.lights ? "+lights" : "", kSkies[kind], makes ? camera_name(features) : ""),
          .file = fmt::format("integrators/{}.comp", integrator.name),
          .defines = std::move(defines)};
}

KernelSource connect_source() { return {.name = "path.connect", .file = "path/connect.comp"}; }

KernelSource film_source(bool moments) {
  return {.name = moments ? "path.film+moments" : "path.film",
          .file = "path/film.comp",
          .defines = {{"BALLOT_MOMENTS", moments}}};
}

KernelSource alpha_source(const SceneFeatures& features) {
  const SceneFeatures seen = alpha_features(features);
  return {.name = "path.alpha" + look_name(seen, true), .file = "path/alpha.comp", .defines = look_defines(seen, true)};
}

}  // namespace ballot
