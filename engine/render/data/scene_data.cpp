#include "engine/render/data/scene_data.h"

#include <bit>
#include <cmath>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/registry.h"
#include "engine/model/instances.h"
#include "engine/render/data/camera.h"
#include "engine/render/data/shadings.h"

namespace ballot {

namespace {

static_assert(kMirrorRoughness == float(MIRROR_ROUGHNESS));
static_assert(int(Sky::Kind::Map) == SKY_MAP && int(Light::Kind::Directional) == LIGHT_DIRECTIONAL);

/// Returns three texels per triangle, one per corner; words[i] goes with the first texel of triangle i.
template <class Corners>
std::vector<glm::uvec4> texels_of(std::span<const Corners> items, std::span<const std::uint32_t> words) {
  std::vector<glm::uvec4> texels(items.size() * 3);
  for (std::size_t i = 0; i < items.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c) {
      const glm::vec3& v = items[i][c];
      texels[i * 3 + c] = {std::bit_cast<std::uint32_t>(v.x), std::bit_cast<std::uint32_t>(v.y),
                           std::bit_cast<std::uint32_t>(v.z), c == 0 && !words.empty() ? words[i] : 0u};
    }
  return texels;
}

/// Returns the contents of BIND_INSTANCES.
std::vector<glm::uvec4> instance_texels(const Scene& scene) {
  const TreeLayout all = tree_layout(scene);
  std::vector<glm::uvec4> texels(PLACED_TEXELS);
  texels[0].x = std::uint32_t(all.placements.size());
  for (std::size_t i = 0; i < all.placements.size(); ++i) {
    const Placement& p = all.placements[i];
    const std::uint32_t first = all.prims[i];
    const auto spread = std::bit_cast<std::uint32_t>(std::nextafter(float(spread_of(p.transform)), INFINITY));
    const bool shapes = all.kinds[p.mesh] != ShapeKind::Triangles;
    texels.push_back({first, std::uint32_t(all.first[p.mesh]) - first, spread, shapes});
    for (const auto& row : p.transform.m) texels.push_back(std::bit_cast<glm::uvec4>(row));
  }
  return texels;
}

std::uint32_t flags_of(const Material& m) {
  std::uint32_t flags = 0;
  if (m.alpha_mode == Alpha::Mask) flags |= MATERIAL_ALPHA_MASK;
  if (m.alpha_mode == Alpha::Blend) flags |= MATERIAL_ALPHA_BLEND;
  if (m.unlit) flags |= MATERIAL_UNLIT;
  if (m.is_lambert()) flags |= MATERIAL_LAMBERT;
  return flags;
}

}  // namespace

/// Binds a buffer to a kernel that wants it. make() returns its content when it is first wanted.
template <class T, class Make>
void SceneData::bind_made(Kernel& kernel, std::uint32_t binding, std::unique_ptr<Buffer<T>>& buffer, Access access,
                          const char* name, const Make& make) {
  if (!kernel.wants(binding)) return;
  if (!buffer) {
    const std::vector<T>& data = make();
    buffer = std::make_unique<Buffer<T>>(gpu_, data.size(), access, name);
    buffer->upload(data);
    bytes_ += buffer->bytes();
  }
  kernel.bind(binding, *buffer);
}

const PackedTextures& SceneData::textures() {
  if (!packed_) packed_ = pack_textures(scene_);
  return *packed_;
}

std::vector<float> SceneData::emitted() {
  std::vector<float> weights;
  for (const Material& m : scene_.materials) {
    glm::vec3 light = m.emits() ? m.emissive : glm::vec3(0);
    if (m.emits() && m.emissive_texture) light *= textures().means[m.emissive_texture.texture];
    weights.push_back(luminance(light));
  }
  return weights;
}

std::vector<GpuMaterial> SceneData::materials() {
  const std::vector<float> weights = emitted();
  std::vector<GpuMaterial> materials;
  for (std::size_t i = 0; i < scene_.materials.size(); ++i) {
    const Material& m = scene_.materials[i];
    materials.push_back({m.base_color, m.alpha, m.emits() ? m.emissive : glm::vec3(0), weights[i], m.metallic,
                         m.roughness, m.transmission, m.ior, m.alpha_cutoff, flags_of(m)});
  }
  return materials;
}

const EmitterTable& SceneData::emitters() {
  late_.bring();
  if (!emitter_table_) emitter_table_ = emitter_table(scene_, emitted());
  return *emitter_table_;
}

void SceneData::bind_textures(Kernel& kernel) {
  bind_made(kernel, BIND_UVS, uvs_, array_access(false), "texture coordinates", [&] { return pack_uvs(scene_); });
  bind_made(kernel, BIND_TEXELS, texels_, Access::Texel, "texels", [&] {
    textures();
    return std::exchange(packed_->texels, {});  // frees the memory; the table is used again
  });
  bind_made(kernel, BIND_TEXTURES, textures_, Access::Storage, "textures", [&] { return textures().table; });
  bind_made(kernel, BIND_TEXTURE_USES, uses_, Access::Storage, "texture uses", [&] { return pack_uses(scene_); });
}

void SceneData::bind_lights(Kernel& kernel) {
  bind_made(kernel, BIND_SKY, sky_, Access::Texel, "sky", [&] { return sky_texels(scene_.sky); });
  bind_made(
      kernel, BIND_EMITTERS, emitters_, Access::Texel, "emitters", [&]() -> const auto& { return emitters().texels; });
  bind_made(kernel, BIND_LIGHTS, lights_, Access::Storage, "lights", [&] { return gpu_lights(scene_); });
}

bool SceneData::exceeds_texels(const Scene& scene, const DeviceInfo& device) {
  std::uint64_t uvs = 0;
  for (const auto& set : scene.uvs) uvs += set.size();
  return std::max(std::uint64_t(scene.triangles.size()) * 3, uvs * 2) > device.max_texels;
}

/// Returns the access to an array with texels for each triangle, which the device writes if its content `moves` there.
Access SceneData::array_access(bool moves) const {
  if (features_.stored) return Access::Storage;
  return moves && scene_.animation ? Access::Texel | Access::Storage : Access::Texel;
}

void SceneData::follow(PosedTriangles& posed) {
  if (triangles_) posed.write(*triangles_, normals_ && !scene_.normals.empty() ? normals_.get() : nullptr);
}

void SceneData::follow_lights() {
  if (lights_) lights_->upload(gpu_lights(scene_));
}

// Kernels compiled for every feature read zeros where the scene has no data, and white vertices. They then use the
// geometric normal and the texture coordinates (0, 0).
void SceneData::bind(Kernel& kernel) {
  if ((kernel.wants(BIND_TRIANGLES) && !triangles_) || (kernel.wants(BIND_NORMALS) && !normals_)) late_.bring();
  bind_made(kernel, BIND_TRIANGLES, triangles_, array_access(true), "triangles",
            [&] { return texels_of(std::span<const Triangle>(scene_.triangles), scene_.material_of); });
  bind_made(kernel, BIND_NORMALS, normals_, array_access(true), "normals", [&] {
    if (scene_.normals.empty()) return std::vector<glm::uvec4>(3 * scene_.triangles.size());
    return texels_of(std::span<const std::array<glm::vec3, 3>>(scene_.normals), {});
  });
  bind_made(kernel, BIND_INSTANCES, instances_, Access::Texel, "instances", [&] {
    late_.bring();
    check_spreads(scene_);
    return instance_texels(scene_);
  });
  bind_made(kernel, BIND_COLORS, colors_, array_access(false), "colours of vertices", [&] {
    constexpr std::uint32_t kOnes = 0x3C003C00;  // two halves
    if (scene_.colors.empty()) return std::vector<glm::uvec4>(2 * scene_.triangles.size(), glm::uvec4(kOnes));
    return pack_colors(scene_);
  });
  bind_made(kernel, BIND_MATERIALS, materials_, Access::Storage, "materials", [&] { return materials(); });
  bind_textures(kernel);
  bind_lights(kernel);
}

namespace {

/// A feature of look_defines(): its define, its word in kernel names, and its value.
struct Asked {
  const char* define;
  const char* word;
  bool has;
};

std::vector<Asked> asked_of(const SceneFeatures& f, bool materials) {
  return {{"BALLOT_HAS_INSTANCES", "instances", f.instances()},
          {"BALLOT_STORED", "stored", f.stored},
          {"BALLOT_HAS_SHAPES", "shapes", f.tree.shapes != 0},
          {"BALLOT_HAS_NORMALS", "normals", f.shading_normals},
          {"BALLOT_HAS_GLOSS", "gloss", materials && f.glossy},
          {"BALLOT_HAS_GLASS", "glass", materials && f.refracts},
          {"BALLOT_HAS_EMISSION", "emission", materials && f.emits},
          {"BALLOT_HAS_ALPHA", "alpha", materials && f.alpha && f.emits},  // of sampled emitters
          {"BALLOT_HAS_UNLIT", "unlit", materials && f.unlit},
          {"BALLOT_HAS_COLORS", "colors", materials && f.vertex_colors},
          {"BALLOT_HAS_BASE_TEXTURE", "base", materials && f.base_texture},
          {"BALLOT_HAS_SURFACE_TEXTURE", "surface", materials && f.surface_texture},
          {"BALLOT_HAS_EMISSIVE_TEXTURE", "glow", materials && f.emissive_texture},
          {"BALLOT_HAS_NORMAL_TEXTURE", "bumps", materials && f.normal_texture}};
}

}  // namespace

Defines look_defines(const SceneFeatures& features, bool materials) {
  Defines defines{{"BALLOT_HAS_MATERIALS", materials}};
  for (const Asked& a : asked_of(features, materials)) defines.emplace_back(a.define, a.has);
  return defines;
}

std::string look_name(const SceneFeatures& features, bool materials) {
  std::string name;
  for (const Asked& a : asked_of(features, materials))
    if (a.has) name += fmt::format("+{}", a.word);
  return name;
}

SceneFeatures alpha_features(const SceneFeatures& features) {
  return {.vertex_colors = features.vertex_colors,
          .base_texture = features.base_texture,
          .stored = features.stored,
          .tree = {.top_depth = features.tree.top_depth, .shapes = features.tree.shapes}};
}

KernelSource shading_source(std::string_view shading, const SceneFeatures& features) {
  const int value = find_named(kShadings, shading, "shading").value;
  const bool materials = value != SHADING_NORMALS;
  // Neither shading depends on how a surface reflects.
  SceneFeatures seen = features;
  seen.glossy = seen.refracts = seen.surface_texture = seen.alpha = false;
  Defines defines = look_defines(seen, materials);
  defines.emplace_back("BALLOT_SHADING", value);
  return {.name = fmt::format("shade.{}{}", shading, look_name(seen, materials)),
          .file = "shade/shade.comp",
          .defines = std::move(defines)};
}

namespace {

/// Returns the source for another file. With `makes_rays` the kernel makes the camera rays again; else it reads them.
KernelSource camera_shading_source(KernelSource source, const char* file, const SceneFeatures& features,
                                   bool makes_rays) {
  if (makes_rays) source.name += camera_name(features);
  source.file = file;
  source.defines.emplace_back("BALLOT_RAYS_READ", !makes_rays);
  if (makes_rays) std::ranges::move(camera_defines(features), std::back_inserter(source.defines));
  return source;
}

}  // namespace

KernelSource samples_source(std::string_view shading, const SceneFeatures& features, bool makes_rays) {
  return camera_shading_source(shading_source(shading, features), "shade/samples.comp", features, makes_rays);
}

KernelSource live_source(std::string_view shading, const SceneFeatures& features, bool makes_rays) {
  KernelSource source =
      camera_shading_source(shading_source(shading, features), "shade/live.comp", features, makes_rays);
  source.name.insert(0, "live.");
  return source;
}

}  // namespace ballot
