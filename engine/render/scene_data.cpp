#include "engine/render/scene_data.h"

#include <bit>

#include "engine/core/error.h"
#include "engine/render/renderer.h"

namespace ballot {

namespace {

/// Three texels a triangle from three corners and a word for the first texel.
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

template <class T>
std::unique_ptr<Buffer<T>> upload(Context& gpu, const std::vector<T>& data, Access access, const char* name) {
  auto buffer = std::make_unique<Buffer<T>>(gpu, data.size(), access, name);
  buffer->upload(data);
  return buffer;
}

}  // namespace

void SceneData::bind(Kernel& kernel) {
  if (kernel.wants(BIND_TRIANGLES)) {
    if (!triangles_)
      triangles_ = upload(gpu_, texels_of(std::span<const Triangle>(scene_.triangles), scene_.material_of),
                          Access::Texel, "triangles");
    kernel.bind(BIND_TRIANGLES, *triangles_);
  }
  if (kernel.wants(BIND_NORMALS)) {
    if (!normals_)
      normals_ = upload(gpu_, texels_of(std::span<const std::array<glm::vec3, 3>>(scene_.normals), {}), Access::Texel,
                        "normals");
    kernel.bind(BIND_NORMALS, *normals_);
  }
  if (kernel.wants(BIND_MATERIALS)) {
    if (!materials_) {
      std::vector<GpuMaterial> materials;
      for (const Material& m : scene_.materials) materials.push_back({m.base_color, m.emissive});
      materials_ = upload(gpu_, materials, Access::Storage, "materials");
    }
    kernel.bind(BIND_MATERIALS, *materials_);
  }
}

KernelSource shading_source(std::string_view shading, const SceneFeatures& features) {
  return {.name = fmt::format("shade.{}{}{}", shading, features.shading_normals ? "+normals" : "",
                              features.emits ? "+emission" : ""),
          .file = "shade/shade.comp",
          .defines = {{"BALLOT_SHADING", find_shading(shading).value},
                      {"BALLOT_HAS_NORMALS", features.shading_normals},
                      {"BALLOT_HAS_EMISSION", features.emits}},
          .constants = {}};
}

}  // namespace ballot
