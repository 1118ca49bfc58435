#include "engine/model/features.h"

#include "engine/model/scene.h"

namespace ballot {

namespace {

void add(SceneFeatures& features, const Material& m) {
  features.unlit |= m.unlit;
  features.alpha |= m.alpha_mode != Alpha::Opaque;
  features.base_texture |= bool(m.base_texture);
  if (m.unlit) return;  // its other properties are never used
  features.reflects |= m.metallic >= 1 && m.roughness < kMirrorRoughness;
  features.refracts |= m.transmission > 0;
  features.emits |= m.emits();
  features.glossy |= !m.is_lambert();
  features.surface_texture |= bool(m.surface_texture);
  features.emissive_texture |= m.emits() && m.emissive_texture;
  features.normal_texture |= bool(m.normal_texture);
}

}  // namespace

SceneFeatures features_of(const Scene& scene, const TreeFacts& tree) {
  std::vector<char> used(scene.materials.size(), 0);
  for (const std::uint32_t m : scene.material_of) used.at(m) = 1;
  if (scene.material_of.empty() && !scene.triangles.empty()) used.at(0) = 1;
  SceneFeatures features{.shading_normals = !scene.normals.empty()};
  for (std::size_t m = 0; m < used.size(); ++m)
    if (used[m]) add(features, scene.materials[m]);
  features.vertex_colors = !scene.colors.empty();
  features.lights = !scene.lights.empty();
  features.sky = scene.sky.kind != Sky::Kind::None;
  features.sky_map = scene.sky.kind == Sky::Kind::Map;
  for (const View& v : scene.views) (v.orthographic ? features.orthographic : features.perspective) = true;
  features.tree = tree;
  return features;
}

}  // namespace ballot
