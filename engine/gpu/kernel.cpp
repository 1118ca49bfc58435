#include "engine/gpu/kernel.h"

#include <algorithm>

#include "engine/core/error.h"

namespace ballot {

Kernel::Kernel(Context& gpu, const KernelSource& source)
    : gpu_(gpu), name_(source.name), generation_(gpu.shader_generation()), pipeline_(pipeline_of(gpu, source)) {
  const Reflection& reflection = pipeline_->reflection();
  for (const auto* bindings : {&reflection.storage_buffers, &reflection.texel_buffers, &reflection.uniform_buffers})
    for (const std::uint32_t b : *bindings) bound_[b] = {};
}

Kernel::~Kernel() {
  try {
    gpu_.finish();
  } catch (const Error&) {
    gpu_.abandon();  // the next call that waits reports the error
  }
  for (const Set& set : sets_) gpu_.vk().DestroyDescriptorPool(gpu_.device(), set.pool, nullptr);
}

Kernel::Set Kernel::create_set() {
  const Reflection& reflection = pipeline_->reflection();
  std::vector<VkDescriptorPoolSize> sizes;
  const auto add = [&](const std::vector<std::uint32_t>& bindings, VkDescriptorType type) {
    if (!bindings.empty()) sizes.push_back({type, std::uint32_t(bindings.size())});
  };
  add(reflection.storage_buffers, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER);
  add(reflection.texel_buffers, VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER);
  add(reflection.uniform_buffers, VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER);
  const VkDescriptorSetLayout set_layout = pipeline_->set_layout();
  VkDescriptorPoolCreateInfo pool{};
  pool.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO;
  pool.maxSets = 1;
  pool.poolSizeCount = std::uint32_t(sizes.size());
  pool.pPoolSizes = sizes.data();
  Set made;
  vk_check(gpu_.vk().CreateDescriptorPool(gpu_.device(), &pool, nullptr, &made.pool), "creating descriptor pool of",
           name_.c_str());
  VkDescriptorSetAllocateInfo allocate{};
  allocate.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO;
  allocate.descriptorPool = made.pool;
  allocate.descriptorSetCount = 1;
  allocate.pSetLayouts = &set_layout;
  const VkResult result = gpu_.vk().AllocateDescriptorSets(gpu_.device(), &allocate, &made.set);
  if (result != VK_SUCCESS) gpu_.vk().DestroyDescriptorPool(gpu_.device(), made.pool, nullptr);
  vk_check(result, "allocating descriptors of", name_.c_str());
  return made;
}

bool Kernel::wants(std::uint32_t binding) const { return bound_.contains(binding); }

void Kernel::bind(std::uint32_t binding, const BufferPart& part) {
  const RawBuffer& buffer = part.buffer;
  const auto found = bound_.find(binding);
  if (found == bound_.end())
    fail(Failure::Work, "kernel {} has no binding {} for buffer '{}'", name_, binding, buffer.name());
  found->second = {buffer.id(), buffer.handle(), buffer.offset() + part.offset, part.bytes, buffer.view()};
}

void Kernel::write(const Set& set) const {
  const Reflection& reflection = pipeline_->reflection();
  const auto holds = [](const std::vector<std::uint32_t>& bindings, std::uint32_t b) {
    return std::ranges::count(bindings, b) > 0;
  };
  for (const auto& [binding, bound] : bound_) {
    const bool texel = holds(reflection.texel_buffers, binding);
    const VkDescriptorBufferInfo info{bound.buffer, bound.offset, bound.bytes};
    VkWriteDescriptorSet write{};
    write.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
    write.dstSet = set.set;
    write.dstBinding = binding;
    write.descriptorCount = 1;
    write.descriptorType = texel                                        ? VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER
                           : holds(reflection.uniform_buffers, binding) ? VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER
                                                                        : VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    write.pBufferInfo = texel ? nullptr : &info;
    write.pTexelBufferView = texel ? &bound.view : nullptr;
    gpu_.vk().UpdateDescriptorSets(gpu_.device(), 1, &write, 0, nullptr);
  }
}

// Returns a descriptor set for the bound buffers. A kernel runs over the same few combinations of buffers again and
// again, so the sets of recently used combinations are kept.
VkDescriptorSet Kernel::set_for_bound() {
  constexpr std::size_t kKept = 8;
  std::vector<Name> names;
  for (const auto& [binding, bound] : bound_) {
    if (!bound.id) fail(Failure::Work, "kernel {} is dispatched without binding {}", name_, binding);
    names.push_back({bound.id, bound.offset, bound.bytes});
  }
  auto set = std::ranges::find(sets_, names, &Set::names);
  if (set == sets_.end()) {
    set = std::ranges::min_element(sets_, {}, &Set::used);
    if (sets_.size() < kKept || set->used > gpu_.ended()) set = sets_.insert(sets_.end(), create_set());
    set->names = std::move(names);
    write(*set);
  }
  set->used = gpu_.recording();
  return set->set;
}

std::pair<std::uint64_t, std::uint64_t> Kernel::descriptors() {
  const VkDescriptorSet set = set_for_bound();
  return {std::uint64_t(pipeline_->set_layout()), std::uint64_t(set)};
}

void Kernel::begin_dispatch(Commands& cmd, const void* push, std::uint32_t push_bytes) {
  if (push_bytes != pipeline_->reflection().push_bytes)
    fail(Failure::Work, "kernel {} wants {} bytes of push constants, not {}", name_, pipeline_->reflection().push_bytes,
         push_bytes);
  const VkDescriptorSet set = set_for_bound();
  if (gpu_.vk().CmdBeginDebugUtilsLabelEXT) {
    VkDebugUtilsLabelEXT label{};
    label.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_LABEL_EXT;
    label.pLabelName = name_.c_str();
    gpu_.vk().CmdBeginDebugUtilsLabelEXT(cmd.handle(), &label);
  }
  gpu_.vk().CmdBindPipeline(cmd.handle(), VK_PIPELINE_BIND_POINT_COMPUTE, pipeline_->pipeline());
  gpu_.vk().CmdBindDescriptorSets(cmd.handle(), VK_PIPELINE_BIND_POINT_COMPUTE, pipeline_->layout(), 0, 1, &set, 0,
                                  nullptr);
  if (push_bytes)
    gpu_.vk().CmdPushConstants(cmd.handle(), pipeline_->layout(), VK_SHADER_STAGE_COMPUTE_BIT, 0, push_bytes, push);
}

void Kernel::end_dispatch(Commands& cmd) const {
  if (gpu_.vk().CmdEndDebugUtilsLabelEXT) gpu_.vk().CmdEndDebugUtilsLabelEXT(cmd.handle());
}

void Kernel::dispatch(Commands& cmd, std::uint32_t groups, const void* push, std::uint32_t push_bytes) {
  if (groups > gpu_.info().max_group_count_x)
    fail(Failure::Work, "kernel {}: a dispatch of {} workgroups, but {} allows at most {}", name_, groups,
         gpu_.info().name, gpu_.info().max_group_count_x);
  begin_dispatch(cmd, push, push_bytes);
  gpu_.vk().CmdDispatch(cmd.handle(), groups, 1, 1);
  end_dispatch(cmd);
}

void Kernel::dispatch(Commands& cmd, const RawBuffer& groups, std::uint64_t offset, const void* push,
                      std::uint32_t push_bytes) {
  begin_dispatch(cmd, push, push_bytes);
  gpu_.vk().CmdDispatchIndirect(cmd.handle(), groups.handle(), groups.offset() + offset);
  end_dispatch(cmd);
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

}  // namespace ballot
