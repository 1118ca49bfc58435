// A compute pipeline with its bindings.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "engine/vk/buffer.h"
#include "engine/vk/shader.h"

namespace ballot {

struct KernelSource {
  std::string name;  // the variant's one name: debug name, log line, error text
  std::string file;  // under shaders/
  Defines defines;
  std::map<std::uint32_t, std::uint32_t> constants;  // specialisation constants by id
  std::uint32_t group_size = 64;
  std::uint32_t subgroup_size = 0;  // required size; 0: whatever the driver gives
};

struct KernelTimes {
  double spirv_ms = 0;  // preprocessing and compiling, or loading from the cache
  double pipeline_ms = 0;
  std::size_t spirv_bytes = 0;
  bool from_cache = false;
};

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
  const KernelTimes& times() const { return times_; }
  /// The Context's shader_generation() when this was made.
  std::uint64_t generation() const { return generation_; }

 private:
  void create(const KernelSource& source, const std::vector<std::uint32_t>& words);
  void create_layout();
  void create_pipeline(const KernelSource& source, VkShaderModule module);
  void destroy();

  Context& gpu_;
  friend bool refresh(Context& gpu, std::unique_ptr<Kernel>& kernel, const KernelSource& source);

  std::string name_;
  std::uint64_t generation_;
  KernelTimes times_;
  Reflection reflection_;
  std::map<std::uint32_t, bool> bound_;
  VkDescriptorSetLayout set_layout_ = VK_NULL_HANDLE;
  VkPipelineLayout layout_ = VK_NULL_HANDLE;
  VkDescriptorPool pool_ = VK_NULL_HANDLE;
  VkDescriptorSet set_ = VK_NULL_HANDLE;
  VkPipeline pipeline_ = VK_NULL_HANDLE;
};

/// Makes a kernel where there is none or shaders were reloaded since it was made. True: it is another one and has no
/// bindings. If a kernel fails to compile anew, it is kept and Context::shader_error() says why; the first one throws.
bool refresh(Context& gpu, std::unique_ptr<Kernel>& kernel, const KernelSource& source);

/// Makes writes of earlier dispatches and copies visible to later dispatches and copies.
void memory_barrier(VkCommandBuffer cmd);

}  // namespace ballot
