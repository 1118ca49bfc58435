#include "engine/vk/kernel.h"

#include <algorithm>
#include <chrono>

#include "engine/core/error.h"

namespace ballot {

Kernel::Kernel(Context& gpu, const KernelSource& source)
    : gpu_(gpu), name_(source.name), generation_(gpu.shader_generation()) {
  try {
    const Spirv spirv = compile_shader(source.file, source.defines);
    times_ = {spirv.ms, 0, spirv.words.size() * 4, spirv.from_cache};
    reflection_ = reflect(spirv.words, name_);
    create(source, spirv.words);
  } catch (...) {
    destroy();
    throw;
  }
}

Kernel::~Kernel() { destroy(); }

void Kernel::destroy() {
  vkDestroyPipeline(gpu_.device(), pipeline_, nullptr);
  vkDestroyDescriptorPool(gpu_.device(), pool_, nullptr);
  vkDestroyPipelineLayout(gpu_.device(), layout_, nullptr);
  vkDestroyDescriptorSetLayout(gpu_.device(), set_layout_, nullptr);
}

void Kernel::create(const KernelSource& source, const std::vector<std::uint32_t>& words) {
  for (std::uint32_t b : reflection_.storage_buffers) bound_[b] = false;
  for (std::uint32_t b : reflection_.texel_buffers) bound_[b] = false;
  create_layout();
  VkShaderModuleCreateInfo create{};
  create.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO;
  create.codeSize = words.size() * 4;
  create.pCode = words.data();
  VkShaderModule module = VK_NULL_HANDLE;
  vk_check(vkCreateShaderModule(gpu_.device(), &create, nullptr, &module), "creating shader", name_.c_str());
  gpu_.name(VK_OBJECT_TYPE_SHADER_MODULE, std::uint64_t(module), name_);
  try {
    create_pipeline(source, module);
  } catch (...) {
    vkDestroyShaderModule(gpu_.device(), module, nullptr);
    throw;
  }
  vkDestroyShaderModule(gpu_.device(), module, nullptr);
}

void Kernel::create_layout() {
  std::vector<VkDescriptorSetLayoutBinding> bindings;
  std::vector<VkDescriptorPoolSize> sizes;
  const auto add = [&](const std::vector<std::uint32_t>& list, VkDescriptorType type) {
    for (std::uint32_t b : list) bindings.push_back({b, type, 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr});
    if (!list.empty()) sizes.push_back({type, std::uint32_t(list.size())});
  };
  add(reflection_.storage_buffers, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER);
  add(reflection_.texel_buffers, VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER);
  VkDescriptorSetLayoutCreateInfo set{};
  set.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO;
  set.bindingCount = std::uint32_t(bindings.size());
  set.pBindings = bindings.data();
  vk_check(vkCreateDescriptorSetLayout(gpu_.device(), &set, nullptr, &set_layout_), "creating set layout of",
           name_.c_str());
  const VkPushConstantRange range{VK_SHADER_STAGE_COMPUTE_BIT, 0, reflection_.push_bytes};
  VkPipelineLayoutCreateInfo layout{};
  layout.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO;
  layout.setLayoutCount = 1;
  layout.pSetLayouts = &set_layout_;
  layout.pushConstantRangeCount = reflection_.push_bytes ? 1 : 0;
  layout.pPushConstantRanges = &range;
  vk_check(vkCreatePipelineLayout(gpu_.device(), &layout, nullptr, &layout_), "creating pipeline layout of",
           name_.c_str());
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
  allocate.pSetLayouts = &set_layout_;
  vk_check(vkAllocateDescriptorSets(gpu_.device(), &allocate, &set_), "allocating descriptors of", name_.c_str());
}

void Kernel::create_pipeline(const KernelSource& source, VkShaderModule module) {
  std::vector<VkSpecializationMapEntry> entries;
  std::vector<std::uint32_t> values;
  for (const auto& [id, value] : source.constants) {
    entries.push_back({id, std::uint32_t(values.size() * 4), 4});
    values.push_back(value);
  }
  const VkSpecializationInfo constants{std::uint32_t(entries.size()), entries.data(), values.size() * 4, values.data()};
  const DeviceInfo& d = gpu_.info();
  VkPipelineShaderStageRequiredSubgroupSizeCreateInfoEXT required{};
  required.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_REQUIRED_SUBGROUP_SIZE_CREATE_INFO_EXT;
  required.requiredSubgroupSize = source.subgroup_size;
  VkComputePipelineCreateInfo create{};
  create.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO;
  create.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
  create.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
  create.stage.module = module;
  create.stage.pName = "main";
  create.stage.pSpecializationInfo = &constants;
  if (source.subgroup_size && d.size_control) create.stage.pNext = &required;
  const std::uint32_t subgroup = source.subgroup_size ? source.subgroup_size : d.subgroup_size;
  if (d.full_subgroups && source.group_size % subgroup == 0)
    create.stage.flags = VK_PIPELINE_SHADER_STAGE_CREATE_REQUIRE_FULL_SUBGROUPS_BIT_EXT;
  create.layout = layout_;
  const auto start = std::chrono::steady_clock::now();
  vk_check(vkCreateComputePipelines(gpu_.device(), gpu_.pipeline_cache(), 1, &create, nullptr, &pipeline_),
           "creating pipeline", name_.c_str());
  times_.pipeline_ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  gpu_.name(VK_OBJECT_TYPE_PIPELINE, std::uint64_t(pipeline_), name_);
}

bool Kernel::wants(std::uint32_t binding) const { return bound_.contains(binding); }

void Kernel::bind(std::uint32_t binding, const RawBuffer& buffer) {
  if (!wants(binding))
    fail(Failure::Work, "kernel {} has no binding {} for buffer '{}'", name_, binding, buffer.name());
  const bool texel = std::ranges::count(reflection_.texel_buffers, binding) > 0;
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
  if (push_bytes != reflection_.push_bytes)
    fail(Failure::Work, "kernel {} wants {} bytes of push constants, not {}", name_, reflection_.push_bytes,
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
  vkCmdBindPipeline(cmd, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline_);
  vkCmdBindDescriptorSets(cmd, VK_PIPELINE_BIND_POINT_COMPUTE, layout_, 0, 1, &set_, 0, nullptr);
  if (push_bytes) vkCmdPushConstants(cmd, layout_, VK_SHADER_STAGE_COMPUTE_BIT, 0, push_bytes, push);
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
