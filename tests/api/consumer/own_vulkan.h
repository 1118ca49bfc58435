// A program's own Vulkan, as small as can be: a device, a buffer that shaders write, compute passes. It knows nothing
// of Ballot. Shaders are compiled by glslangValidator (Debian: glslang-tools).
#pragma once

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>
#include <vulkan/vulkan_raii.hpp>

/// An instance, its first device, and a queue with compute.
struct OwnVulkan {
  /// `with`: layers and extensions of the instance. `features`: more than Ballot needs.
  explicit OwnVulkan(vk::InstanceCreateInfo with = {}, vk::PhysicalDeviceVulkan12Features features = {})
      : instance(context, with.setPApplicationInfo(&application)),
        physical(std::move(vk::raii::PhysicalDevices(instance).front())),
        device(make_device(features)),
        queue(device, family, 0) {}

  vk::ApplicationInfo application{"own", 1, nullptr, 0, VK_API_VERSION_1_2};
  vk::raii::Context context;
  vk::raii::Instance instance;
  vk::raii::PhysicalDevice physical;
  std::uint32_t family = 0;
  vk::raii::Device device;
  vk::raii::Queue queue;

 private:
  vk::raii::Device make_device(vk::PhysicalDeviceVulkan12Features features) {
    const auto families = physical.getQueueFamilyProperties();
    while (!(families.at(family).queueFlags & vk::QueueFlagBits::eCompute)) ++family;
    const float priority = 1;
    const vk::DeviceQueueCreateInfo queues({}, family, 1, &priority);
    features.scalarBlockLayout = VK_TRUE;  // all that Ballot needs
    return {physical, vk::DeviceCreateInfo({}, 1, &queues, 0, nullptr, 0, nullptr, nullptr, &features)};
  }
};

/// A storage buffer that the host sees, alone in a descriptor set.
struct OwnBuffer {
  OwnBuffer(const OwnVulkan& of, std::size_t bytes)
      : buffer(of.device, vk::BufferCreateInfo({}, bytes, vk::BufferUsageFlagBits::eStorageBuffer)),
        memory(of.device, allocation(of, buffer.getMemoryRequirements())),
        layout(of.device, vk::DescriptorSetLayoutCreateInfo({}, 1, &kBinding)),
        pool(of.device,
             vk::DescriptorPoolCreateInfo(vk::DescriptorPoolCreateFlagBits::eFreeDescriptorSet, 1, 1, &kOne)),
        set(std::move(vk::raii::DescriptorSets(of.device, vk::DescriptorSetAllocateInfo(*pool, 1, &*layout)).front())) {
    buffer.bindMemory(*memory, 0);
    mapped = memory.mapMemory(0, VK_WHOLE_SIZE);
    const vk::DescriptorBufferInfo whole(*buffer, 0, VK_WHOLE_SIZE);
    const vk::WriteDescriptorSet write(*set, 0, 0, 1, vk::DescriptorType::eStorageBuffer, nullptr, &whole);
    of.device.updateDescriptorSets(write, nullptr);
  }
  static constexpr vk::DescriptorSetLayoutBinding kBinding{0, vk::DescriptorType::eStorageBuffer, 1,
                                                           vk::ShaderStageFlagBits::eCompute};
  static constexpr vk::DescriptorPoolSize kOne{vk::DescriptorType::eStorageBuffer, 1};
  vk::raii::Buffer buffer;
  vk::raii::DeviceMemory memory;
  vk::raii::DescriptorSetLayout layout;
  vk::raii::DescriptorPool pool;
  vk::raii::DescriptorSet set;
  void* mapped = nullptr;

 private:
  static vk::MemoryAllocateInfo allocation(const OwnVulkan& of, const vk::MemoryRequirements& needs) {
    constexpr auto kHost = vk::MemoryPropertyFlagBits::eHostVisible | vk::MemoryPropertyFlagBits::eHostCoherent;
    const auto types = of.physical.getMemoryProperties().memoryTypes;
    std::uint32_t type = 0;
    while (!(needs.memoryTypeBits >> type & 1) || (types.at(type).propertyFlags & kHost) != kHost) ++type;
    return {needs.size, type};
  }
};

/// Returns SPIR-V of a compute shader.
inline std::vector<std::uint32_t> compiled(const std::string& text) {
  const std::string file = (std::filesystem::temp_directory_path() / "own_vulkan.").string() +
                           std::to_string(std::hash<std::string>()(text) ^ std::size_t(std::random_device()()));
  std::ofstream(file + ".comp") << text;
  const std::string compiler = "glslangValidator -V --target-env vulkan1.2 --quiet -o ";
  const bool failed = std::system((compiler + file + ".spv " + file + ".comp >&2").c_str()) != 0;
  std::ifstream in(file + ".spv", std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  std::filesystem::remove(file + ".comp"), std::filesystem::remove(file + ".spv");
  if (failed) throw std::runtime_error("a shader does not compile");
  std::vector<std::uint32_t> words(bytes.size() / 4);
  std::memcpy(words.data(), bytes.data(), bytes.size());
  return words;
}

/// A compute shader with a buffer in set 0, another set in set 1, and push constants.
struct OwnPass {
  OwnPass(const OwnVulkan& of, const OwnBuffer& own, vk::DescriptorSetLayout other, std::uint32_t push_bytes,
          const std::string& text)
      : vulkan(of), layout(make_layout(of, {*own.layout, other}, push_bytes)), pipeline(make_pipeline(text)) {}

  /// Dispatches workgroups, and waits until the host sees what they wrote.
  template <class Push>
  void run(const OwnBuffer& own, vk::DescriptorSet other, const Push& push, std::uint32_t x, std::uint32_t y) const {
    const vk::raii::CommandPool pool(vulkan.device, vk::CommandPoolCreateInfo({}, vulkan.family));
    const vk::raii::CommandBuffers buffers(vulkan.device, vk::CommandBufferAllocateInfo(*pool, {}, 1));
    const vk::raii::CommandBuffer& commands = buffers.front();
    commands.begin(vk::CommandBufferBeginInfo());
    commands.bindPipeline(vk::PipelineBindPoint::eCompute, *pipeline);
    commands.bindDescriptorSets(vk::PipelineBindPoint::eCompute, *layout, 0, {*own.set, other}, nullptr);
    commands.pushConstants<Push>(*layout, vk::ShaderStageFlagBits::eCompute, 0, push);
    commands.dispatch(x, y, 1);
    const vk::MemoryBarrier written(vk::AccessFlagBits::eShaderWrite, vk::AccessFlagBits::eHostRead);
    commands.pipelineBarrier(vk::PipelineStageFlagBits::eComputeShader, vk::PipelineStageFlagBits::eHost, {}, written,
                             nullptr, nullptr);
    commands.end();
    vulkan.queue.submit(vk::SubmitInfo(0, nullptr, nullptr, 1, &*commands));
    vulkan.queue.waitIdle();
  }

  const OwnVulkan& vulkan;
  vk::raii::PipelineLayout layout;
  vk::raii::Pipeline pipeline;

 private:
  static vk::raii::PipelineLayout make_layout(const OwnVulkan& of, const std::vector<vk::DescriptorSetLayout>& sets,
                                              std::uint32_t push_bytes) {
    const vk::PushConstantRange push(vk::ShaderStageFlagBits::eCompute, 0, push_bytes);
    return {of.device, vk::PipelineLayoutCreateInfo({}, sets, push)};
  }
  vk::raii::Pipeline make_pipeline(const std::string& text) {
    const std::vector<std::uint32_t> words = compiled(text);
    const vk::raii::ShaderModule module(vulkan.device, vk::ShaderModuleCreateInfo({}, words));
    const vk::PipelineShaderStageCreateInfo stage({}, vk::ShaderStageFlagBits::eCompute, *module, "main");
    return {vulkan.device, nullptr, vk::ComputePipelineCreateInfo({}, stage, *layout)};
  }
};
