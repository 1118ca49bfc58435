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

  /// Binds a buffer, as the shader declares the binding, for what is recorded from now on. Throws Error(Work) if the shader has
  /// no such binding.
  void bind(std::uint32_t binding, const RawBuffer& buffer);
  bool wants(std::uint32_t binding) const;

  /// Records one dispatch; throws Error(Work) if a binding is missing or the push constants' size is not the shader's.
  void dispatch(VkCommandBuffer cmd, std::uint32_t groups, const void* push, std::uint32_t push_bytes);
  template <class P>
  void dispatch(VkCommandBuffer cmd, std::uint32_t groups, const P& push) {
    dispatch(cmd, groups, &push, sizeof push);
  }
  /// The same, but the device reads the numbers of groups (x, y, z) from a buffer for Access::Groups.
  void dispatch(VkCommandBuffer cmd, const RawBuffer& groups, std::uint64_t offset, const void* push,
                std::uint32_t push_bytes);

  const std::string& name() const { return name_; }
  /// Of its pipeline, when that was made.
  const KernelTimes& times() const { return pipeline_->times(); }
  std::vector<PipelineFigure> statistics() const { return pipeline_->statistics(); }
  /// The Context's shader_generation() when this was made.
  std::uint64_t generation() const { return generation_; }

 private:
  /// What is bound.
  struct Bound {
    std::uint64_t id = 0;  // of the buffer; 0: none
    VkBuffer buffer = VK_NULL_HANDLE;
    std::uint64_t bytes = 0;  // of it that kernels may see
    VkBufferView view = VK_NULL_HANDLE;
  };
  /// A descriptor set; what submissions that have not ended use is left as it is.
  struct Set {
    VkDescriptorPool pool = VK_NULL_HANDLE;
    VkDescriptorSet set = VK_NULL_HANDLE;
    std::vector<std::uint64_t> ids;  // of the buffers, in the order of the bindings
    std::uint64_t used = 0;          // by this submission last
  };

  Set create_set();
  void write(const Set& set) const;
  VkDescriptorSet set_for_bound();
  void begin_dispatch(VkCommandBuffer cmd, const void* push, std::uint32_t push_bytes);
  void end_dispatch(VkCommandBuffer cmd) const;

  Context& gpu_;
  friend bool refresh(Context& gpu, std::unique_ptr<Kernel>& kernel, const KernelSource& source);

  std::string name_;
  std::uint64_t generation_;
  std::shared_ptr<const ComputePipeline> pipeline_;
  std::map<std::uint32_t, Bound> bound_;
  std::vector<Set> sets_;
};

/// Makes a kernel where there is none or shaders were reloaded since it was made. True: it is another one and has no
/// bindings. If a kernel fails to compile anew, it is kept and Context::shader_error() says why; the first one throws.
bool refresh(Context& gpu, std::unique_ptr<Kernel>& kernel, const KernelSource& source);

}  // namespace ballot
