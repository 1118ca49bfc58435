#include "engine/vk/kernel.h"

#include <algorithm>

#include "engine/core/error.h"

namespace ballot {

Kernel::Kernel(Context& gpu, const KernelSource& source)
    : gpu_(gpu), name_(source.name), generation_(gpu.shader_generation()), pipeline_(pipeline_of(gpu, source)) {
  try {
    create_set();
  } catch (...) {
    vkDestroyDescriptorPool(gpu_.device(), pool_, nullptr);
    throw;
  }
}

Kernel::~Kernel() { vkDestroyDescriptorPool(gpu_.device(), pool_, nullptr); }

void Kernel::create_set() {
  const Reflection& reflection = pipeline_->reflection();
  std::vector<VkDescriptorPoolSize> sizes;
  const auto add = [&](const std::vector<std::uint32_t>& bindings, VkDescriptorType type) {
    for (std::uint32_t b : bindings) bound_[b] = false;
    if (!bindings.empty()) sizes.push_back({type, std::uint32_t(bindings.size())});
  };
  add(reflection.storage_buffers, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER);
  add(reflection.texel_buffers, VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER);
  const VkDescriptorSetLayout set_layout = pipeline_->set_layout();
  VkDescriptorPoolCreateInfo pool{};
  pool.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO;
  pool.maxSets = 1;
  pool.poolSizeCount = std::uint32_t(sizes.size());
  pool.pPoolSizes = sizes.data();
  vk_check(vkCreateDescriptorPool(gpu_.device(), &pool, nullptr, &pool_), "creating descriptor pool of", name_.c_str());
  VkDescriptorSetAllocateInfo allocate{};
  allocate.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO;
  allocate.descriptorPool = pool_;
  allocate.descriptorSetCount = 1;
  allocate.pSetLayouts = &set_layout;
  vk_check(vkAllocateDescriptorSets(gpu_.device(), &allocate, &set_), "allocating descriptors of", name_.c_str());
}

bool Kernel::wants(std::uint32_t binding) const { return bound_.contains(binding); }

void Kernel::bind(std::uint32_t binding, const RawBuffer& buffer) {
  if (!wants(binding))
    fail(Failure::Work, "kernel {} has no binding {} for buffer '{}'", name_, binding, buffer.name());
  const bool texel = std::ranges::count(pipeline_->reflection().texel_buffers, binding) > 0;
  const VkDescriptorBufferInfo info{buffer.handle(), 0, VK_WHOLE_SIZE};
  const VkBufferView view = buffer.view();
  VkWriteDescriptorSet write{};
  write.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
  write.dstSet = set_;
  write.dstBinding = binding;
  write.descriptorCount = 1;
  write.descriptorType = texel ? VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER : VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
  write.pBufferInfo = texel ? nullptr : &info;
  write.pTexelBufferView = texel ? &view : nullptr;
  vkUpdateDescriptorSets(gpu_.device(), 1, &write, 0, nullptr);
  bound_[binding] = true;
}

void Kernel::dispatch(VkCommandBuffer cmd, std::uint32_t groups, const void* push, std::uint32_t push_bytes) {
  for (const auto& [binding, done] : bound_)
    if (!done) fail(Failure::Work, "kernel {} is dispatched without binding {}", name_, binding);
  if (push_bytes != pipeline_->reflection().push_bytes)
    fail(Failure::Work, "kernel {} wants {} bytes of push constants, not {}", name_, pipeline_->reflection().push_bytes,
         push_bytes);
  if (groups > gpu_.info().max_group_count_x)
    fail(Failure::Work, "kernel {}: {} workgroups, but {} allows {}", name_, groups, gpu_.info().name,
         gpu_.info().max_group_count_x);
  if (vkCmdBeginDebugUtilsLabelEXT) {
    VkDebugUtilsLabelEXT label{};
    label.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_LABEL_EXT;
    label.pLabelName = name_.c_str();
    vkCmdBeginDebugUtilsLabelEXT(cmd, &label);
  }
  vkCmdBindPipeline(cmd, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline_->pipeline());
  vkCmdBindDescriptorSets(cmd, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline_->layout(), 0, 1, &set_, 0, nullptr);
  if (push_bytes) vkCmdPushConstants(cmd, pipeline_->layout(), VK_SHADER_STAGE_COMPUTE_BIT, 0, push_bytes, push);
  vkCmdDispatch(cmd, groups, 1, 1);
  if (vkCmdEndDebugUtilsLabelEXT) vkCmdEndDebugUtilsLabelEXT(cmd);
}

bool refresh(Context& gpu, std::unique_ptr<Kernel>& kernel, const KernelSource& source) {
  if (kernel && kernel->generation() == gpu.shader_generation()) return false;
  try {
    kernel = std::make_unique<Kernel>(gpu, source);
    return true;
  } catch (const Error& error) {
    if (!kernel) throw;
    kernel->generation_ = gpu.shader_generation();
    gpu.set_shader_error(error.what());
    return false;
  }
}

void memory_barrier(VkCommandBuffer cmd) {
  VkMemoryBarrier barrier{};
  barrier.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER;
  barrier.srcAccessMask = VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_TRANSFER_WRITE_BIT;
  barrier.dstAccessMask = VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_TRANSFER_READ_BIT |
                          VK_ACCESS_TRANSFER_WRITE_BIT;
  const VkPipelineStageFlags stages = VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_TRANSFER_BIT;
  vkCmdPipelineBarrier(cmd, stages, stages, 0, 1, &barrier, 0, nullptr, 0, nullptr);
}

}  // namespace ballot
