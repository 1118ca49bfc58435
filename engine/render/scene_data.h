// What generators and shading read of a scene on the device.
#pragma once

#include <memory>

#include "engine/scene/scene.h"
#include "engine/vk/kernel.h"
#include "shaders/shared/render.h"

namespace ballot {

/// Buffers made on first use; what the scene lacks has none.
class SceneData {
 public:
  /// Keeps references to both.
  SceneData(Context& gpu, const Scene& scene) : gpu_(gpu), scene_(scene) {}

  /// Binds what the kernel wants of the scene: BIND_TRIANGLES, BIND_NORMALS, BIND_MATERIALS. Throws Error(Work) if the
  /// device cannot hold it.
  void bind(Kernel& kernel);

  const Scene& scene() const { return scene_; }

 private:
  Context& gpu_;
  const Scene& scene_;
  std::unique_ptr<Buffer<glm::uvec4>> triangles_, normals_;
  std::unique_ptr<Buffer<GpuMaterial>> materials_;
};

/// The kernel of a shading (a name of kShadings), for what the scene holds.
KernelSource shading_source(std::string_view shading, const SceneFeatures& features);

}  // namespace ballot
