// A program with its bindings.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "engine/vk/buffer.h"
#include "engine/vk/program.h"

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
  /// Of its program, when that was made.
  const KernelTimes& times() const { return program_->times(); }

 private:
  void create_set();

  Context& gpu_;
  std::string name_;
  std::shared_ptr<const Program> program_;
  std::map<std::uint32_t, bool> bound_;
  VkDescriptorPool pool_ = VK_NULL_HANDLE;
  VkDescriptorSet set_ = VK_NULL_HANDLE;
};

/// Makes writes of earlier dispatches and copies visible to later dispatches and copies.
void memory_barrier(VkCommandBuffer cmd);

}  // namespace ballot
