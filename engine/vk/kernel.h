// A pipeline with its bindings.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "engine/vk/buffer.h"
#include "engine/vk/pipeline.h"

namespace ballot {

class Kernel {
 public:
  /// Throws Error(Work) that names the variant on any failure.
  Kernel(Context& gpu, const KernelSource& source);
  ~Kernel();
  Kernel(const Kernel&) = delete;
  Kernel& operator=(const Kernel&) = delete;

  /// Binds a buffer, as the shader declares the binding. Throws Error(Work) if the shader has no such binding.
  void bind(std::uint32_t binding, const RawBuffer& buffer);
  bool wants(std::uint32_t binding) const;

  /// Records one dispatch; throws Error(Work) if a binding is missing or the push constants' size is not the shader's.
  void dispatch(VkCommandBuffer cmd, std::uint32_t groups, const void* push, std::uint32_t push_bytes);
  template <class P>
  void dispatch(VkCommandBuffer cmd, std::uint32_t groups, const P& push) {
    dispatch(cmd, groups, &push, sizeof push);
  }

  const std::string& name() const { return name_; }
  /// Of its pipeline, when that was made.
  const KernelTimes& times() const { return pipeline_->times(); }
  std::vector<PipelineFigure> statistics() const { return pipeline_->statistics(); }
  /// The Context's shader_generation() when this was made.
  std::uint64_t generation() const { return generation_; }

 private:
  void create_set();

  Context& gpu_;
  friend bool refresh(Context& gpu, std::unique_ptr<Kernel>& kernel, const KernelSource& source);

  std::string name_;
  std::uint64_t generation_;
  std::shared_ptr<const ComputePipeline> pipeline_;
  std::map<std::uint32_t, bool> bound_;
  VkDescriptorPool pool_ = VK_NULL_HANDLE;
  VkDescriptorSet set_ = VK_NULL_HANDLE;
};

/// Makes a kernel where there is none or shaders were reloaded since it was made. True: it is another one and has no
/// bindings. If a kernel fails to compile anew, it is kept and Context::shader_error() says why; the first one throws.
bool refresh(Context& gpu, std::unique_ptr<Kernel>& kernel, const KernelSource& source);

/// Makes writes of earlier dispatches and copies visible to later dispatches and copies.
void memory_barrier(VkCommandBuffer cmd);

}  // namespace ballot
