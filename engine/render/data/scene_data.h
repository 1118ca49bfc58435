// What generators and shading read of a scene on the device.
#pragma once

#include <memory>
#include <optional>

#include "engine/render/data/light_data.h"
#include "engine/render/data/texture_data.h"
#include "engine/scene/scene.h"
#include "engine/vk/kernel.h"
#include "shaders/shared/render.h"

namespace ballot {

/// Buffers made on first use; what the scene lacks has none.
class SceneData {
 public:
  /// Keeps references to the first two. `features` are the scene's.
  SceneData(Context& gpu, const Scene& scene, const SceneFeatures& features)
      : gpu_(gpu), scene_(scene), features_(features) {}

  /// Binds what the kernel wants of the scene: triangles, normals, texture coordinates, textures, materials, what gives
  /// light. Throws Error(Work) if the device cannot hold it.
  void bind(Kernel& kernel);

  const Scene& scene() const { return scene_; }
  const SceneFeatures& features() const { return features_; }
  /// Triangles that emit; made on first use.
  const EmitterTable& emitters();
  /// Bytes on the device so far.
  std::uint64_t bytes() const { return bytes_; }

 private:
  using Texels = std::unique_ptr<Buffer<glm::uvec4>>;
  void bind_textures(Kernel& kernel);
  void bind_lights(Kernel& kernel);
  const PackedTextures& textures();
  std::vector<float> emitted();
  std::vector<GpuMaterial> materials();
  template <class T>
  std::unique_ptr<Buffer<T>> upload(const std::vector<T>& data, Access access, const char* name);

  Context& gpu_;
  const Scene& scene_;
  SceneFeatures features_;
  std::uint64_t bytes_ = 0;
  std::optional<PackedTextures> packed_;
  std::optional<EmitterTable> emitter_table_;
  Texels triangles_, normals_, uvs_, texels_, sky_, emitters_;
  std::unique_ptr<Buffer<GpuMaterial>> materials_;
  std::unique_ptr<Buffer<GpuTexture>> textures_;
  std::unique_ptr<Buffer<GpuTextureUse>> uses_;
  std::unique_ptr<Buffer<GpuLight>> lights_;
};

/// BALLOT_HAS_* of shaders/lib/shade/surface_material.glsl: what a look at a surface asks of the scene.
Defines look_defines(const SceneFeatures& features, bool materials);

/// What is asked for, as part of a kernel's name: "+normals+emission".
std::string look_name(const SceneFeatures& features, bool materials);

/// The kernel of a shading (a name of kShadings), for what the scene holds.
KernelSource shading_source(std::string_view shading, const SceneFeatures& features);

/// The same of camera rays, several samples a pixel, by a camera of the kinds that the features name; as makes_rays says, rays are made
/// again or read (shaders/shade/samples.comp).
KernelSource samples_source(std::string_view shading, const SceneFeatures& features, bool makes_rays);

/// The same for a window's picture, one sample a pixel; rays that are read may be of any kind (shaders/shade/live.comp).
KernelSource live_source(std::string_view shading, const SceneFeatures& features, bool makes_rays);

}  // namespace ballot
