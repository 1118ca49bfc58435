// The buffers of a scene on the device that ray generators and shading read.
#pragma once

#include <memory>
#include <optional>

#include "engine/gpu/kernel.h"
#include "engine/model/host_copy.h"
#include "engine/model/scene.h"
#include "engine/render/data/light_data.h"
#include "engine/render/data/texture_data.h"
#include "engine/tree/device/posed_triangles.h"
#include "shaders/shared/render.h"

namespace ballot {

/// The scene's buffers. Each is made on first use; there is no buffer for a feature that the scene lacks. Belongs to
/// one thread.
class SceneData {
 public:
  /// Keeps references to `gpu`, `scene` and `late`, which tells whether the scene's vertices have moved on the device.
  /// `features` must be those of the scene.
  SceneData(Context& gpu, const Scene& scene, const SceneFeatures& features, const HostCopy& late)
      : gpu_(gpu), scene_(scene), features_(features), late_(late) {}

  /// Returns true if the scene has more triangles than a texel buffer of the device can hold: SceneFeatures::stored.
  static bool exceeds_texels(const Scene& scene, const DeviceInfo& device);

  /// Binds the buffers of the scene that the kernel declares: triangles, instances, normals, colours, texture
  /// coordinates, textures, materials, lights. Throws Error(Work) if the device cannot hold them.
  void bind(Kernel& kernel);

  /// Record that what is on the device already follows triangles that have moved there, and lights that have moved
  /// here. Not for scenes whose triangles emit light: their table of emitters is made anew.
  void follow(PosedTriangles& posed);
  void follow_lights();

  const Scene& scene() const { return scene_; }
  const SceneFeatures& features() const { return features_; }
  /// Returns the table of emissive triangles; made on first use.
  const EmitterTable& emitters();
  /// Returns the bytes on the device so far.
  std::uint64_t bytes() const { return bytes_; }

 private:
  using Texels = std::unique_ptr<Buffer<glm::uvec4>>;
  void bind_textures(Kernel& kernel);
  void bind_lights(Kernel& kernel);
  const PackedTextures& textures();
  std::vector<float> emitted();
  std::vector<GpuMaterial> materials();
  Access array_access(bool moves) const;
  template <class T, class Make>
  void bind_made(Kernel& kernel, std::uint32_t binding, std::unique_ptr<Buffer<T>>& buffer, Access access,
                 const char* name, const Make& make);

  Context& gpu_;
  const Scene& scene_;
  SceneFeatures features_;
  const HostCopy& late_;
  std::uint64_t bytes_ = 0;
  std::optional<PackedTextures> packed_;
  std::optional<EmitterTable> emitter_table_;
  Texels triangles_, instances_, normals_, colors_, uvs_, texels_, sky_, emitters_;
  std::unique_ptr<Buffer<GpuMaterial>> materials_;
  std::unique_ptr<Buffer<GpuTexture>> textures_;
  std::unique_ptr<Buffer<GpuTextureUse>> uses_;
  std::unique_ptr<Buffer<GpuLight>> lights_;
};

/// Returns the defines BALLOT_HAS_* of shaders/lib/shade/surface_material.glsl for these features. Without `materials`
/// the kernel reads no material.
Defines look_defines(const SceneFeatures& features, bool materials);

/// Returns what look_defines() adds to a kernel's name, such as "+normals+emission".
std::string look_name(const SceneFeatures& features, bool materials);

/// Returns those of the features that opacity() of shaders/lib/shade/surface_material.glsl depends on.
SceneFeatures alpha_features(const SceneFeatures& features);

/// Returns the kernel of a shading (a name of kShadings) for a scene with these features.
KernelSource shading_source(std::string_view shading, const SceneFeatures& features);

/// Returns the kernel of a shading for camera rays with several samples per pixel (shaders/shade/samples.comp). With
/// `makes_rays` it makes the rays again, for cameras of the kinds among the features; else it reads them.
KernelSource samples_source(std::string_view shading, const SceneFeatures& features, bool makes_rays);

/// Returns the kernel of a shading for the picture of a window, one sample per pixel (shaders/shade/live.comp).
/// `makes_rays`: as for samples_source(). Rays that are read may be of any kind.
KernelSource live_source(std::string_view shading, const SceneFeatures& features, bool makes_rays);

}  // namespace ballot
