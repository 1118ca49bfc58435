#include "engine/gpu/pipeline.h"

#include <algorithm>
#include <future>

#include "engine/core/error.h"
#include "engine/core/memory.h"
#include "engine/core/stopwatch.h"

namespace ballot {

namespace {

double number_of(const VkPipelineExecutableStatisticKHR& s) {
  switch (s.format) {
    case VK_PIPELINE_EXECUTABLE_STATISTIC_FORMAT_INT64_KHR:
      return double(s.value.i64);
    case VK_PIPELINE_EXECUTABLE_STATISTIC_FORMAT_UINT64_KHR:
      return double(s.value.u64);
    case VK_PIPELINE_EXECUTABLE_STATISTIC_FORMAT_FLOAT64_KHR:
      return s.value.f64;
    default:
      return s.value.b32;
  }
}

}  // namespace

// CPU devices read records through texel buffers, because that is faster there. Speed-up on lavapipe 22.3.6, scenes
// sponza and cornell-water: shading of eyelight 1.9 times, scattering of ao 1.5 and of path 1.2, connecting 1.8 to 2.3,
// sums of samples 3.0 to 3.8. On 25.0.7: 1.0 to 1.1.
Defines defines_of(const KernelSource& source, const DeviceInfo& device) {
  Defines defines = source.defines;
  defines.emplace_back("BALLOT_TEXEL_RECORDS", device.is_cpu());
  return defines;
}

ComputePipeline::ComputePipeline(Context& gpu, const KernelSource& source, const Spirv& spirv) : gpu_(gpu) {
  try {
    times_ = {spirv.ms, 0, spirv.words.size() * 4, spirv.from_cache};
    reflection_ = reflect(spirv.words, source.name);
    create(source, spirv.words);
  } catch (...) {
    destroy();
    throw;
  }
}

ComputePipeline::~ComputePipeline() { destroy(); }

void ComputePipeline::destroy() {
  gpu_.unname(VK_OBJECT_TYPE_PIPELINE, std::uint64_t(pipeline_));
  gpu_.vk().DestroyPipeline(gpu_.device(), pipeline_, nullptr);
  gpu_.vk().DestroyPipelineLayout(gpu_.device(), layout_, nullptr);
  gpu_.vk().DestroyDescriptorSetLayout(gpu_.device(), set_layout_, nullptr);
}

void ComputePipeline::create(const KernelSource& source, const std::vector<std::uint32_t>& words) {
  create_layout(source.name);
  VkShaderModuleCreateInfo create{};
  create.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO;
  create.codeSize = words.size() * 4;
  create.pCode = words.data();
  VkShaderModule module = VK_NULL_HANDLE;
  vk_check(gpu_.vk().CreateShaderModule(gpu_.device(), &create, nullptr, &module), "creating shader",
           source.name.c_str());
  gpu_.name(VK_OBJECT_TYPE_SHADER_MODULE, std::uint64_t(module), source.name);
  const auto destroy = [&] {
    gpu_.unname(VK_OBJECT_TYPE_SHADER_MODULE, std::uint64_t(module));
    gpu_.vk().DestroyShaderModule(gpu_.device(), module, nullptr);
  };
  try {
    create_pipeline(source, module);
  } catch (...) {
    destroy();
    throw;
  }
  destroy();
}

void ComputePipeline::create_layout(const std::string& name) {
  if (reflection_.storage_buffers.size() > gpu_.info().max_storage_buffers)
    fail(Failure::Work, "kernel {} reads and writes {} buffers, but {} allows a kernel {}", name,
         reflection_.storage_buffers.size(), gpu_.info().name, gpu_.info().max_storage_buffers);
  std::vector<VkDescriptorSetLayoutBinding> bindings;
  const auto add = [&](const std::vector<std::uint32_t>& list, VkDescriptorType type) {
    for (std::uint32_t b : list) bindings.push_back({b, type, 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr});
  };
  add(reflection_.storage_buffers, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER);
  add(reflection_.texel_buffers, VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER);
  add(reflection_.uniform_buffers, VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER);
  VkDescriptorSetLayoutCreateInfo set{};
  set.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO;
  set.bindingCount = std::uint32_t(bindings.size());
  set.pBindings = bindings.data();
  vk_check(gpu_.vk().CreateDescriptorSetLayout(gpu_.device(), &set, nullptr, &set_layout_), "creating set layout of",
           name.c_str());
  const VkPushConstantRange range{VK_SHADER_STAGE_COMPUTE_BIT, 0, reflection_.push_bytes};
  VkPipelineLayoutCreateInfo layout{};
  layout.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO;
  layout.setLayoutCount = 1;
  layout.pSetLayouts = &set_layout_;
  layout.pushConstantRangeCount = reflection_.push_bytes ? 1 : 0;
  layout.pPushConstantRanges = &range;
  vk_check(gpu_.vk().CreatePipelineLayout(gpu_.device(), &layout, nullptr, &layout_), "creating pipeline layout of",
           name.c_str());
}

void ComputePipeline::create_pipeline(const KernelSource& source, VkShaderModule module) {
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
  VkPipelineRobustnessCreateInfoEXT robustness{};
  robustness.sType = VK_STRUCTURE_TYPE_PIPELINE_ROBUSTNESS_CREATE_INFO_EXT;
  robustness.storageBuffers = VK_PIPELINE_ROBUSTNESS_BUFFER_BEHAVIOR_ROBUST_BUFFER_ACCESS_EXT;
  if (source.robust && d.pipeline_robustness) create.pNext = &robustness;
  if (gpu_.keeps_statistics()) create.flags |= VK_PIPELINE_CREATE_CAPTURE_STATISTICS_BIT_KHR;
  constexpr std::uint64_t kCompiling = 128 << 20;  // address space of LLVM for the largest kernel, with some to spare
  if (d.is_cpu()) need_driver_space(kCompiling, 0, "compiling kernel " + source.name);
  const Timer timer;
  vk_check(gpu_.vk().CreateComputePipelines(gpu_.device(), gpu_.pipeline_cache(), 1, &create, nullptr, &pipeline_),
           "creating pipeline", source.name.c_str());
  times_.pipeline_ms = timer.ms();
  gpu_.name(VK_OBJECT_TYPE_PIPELINE, std::uint64_t(pipeline_), source.name);
}

std::vector<PipelineFigure> ComputePipeline::statistics() const {
  if (!gpu_.keeps_statistics()) return {};
  VkPipelineExecutableInfoKHR which{};
  which.sType = VK_STRUCTURE_TYPE_PIPELINE_EXECUTABLE_INFO_KHR;
  which.pipeline = pipeline_;  // a compute pipeline's statistics are those of its first executable
  std::uint32_t count = 0;
  vk_check(gpu_.vk().GetPipelineExecutableStatisticsKHR(gpu_.device(), &which, &count, nullptr),
           "reading pipeline statistics");
  std::vector<VkPipelineExecutableStatisticKHR> all(count);
  for (auto& each : all) each.sType = VK_STRUCTURE_TYPE_PIPELINE_EXECUTABLE_STATISTIC_KHR;
  vk_check(gpu_.vk().GetPipelineExecutableStatisticsKHR(gpu_.device(), &which, &count, all.data()),
           "reading pipeline statistics");
  std::vector<PipelineFigure> figures;
  for (const auto& each : all) figures.push_back({each.name, each.description, number_of(each)});
  return figures;
}

/// The pipelines of a context by their sources.
struct Pipelines {
  using Made = std::shared_ptr<const ComputePipeline>;
  /// A pipeline, or the thread that makes it.
  struct Entry {
    Made made = {};
    std::future<Made> coming = {};
  };
  std::map<std::string, Entry> by_source;
  std::map<std::string, std::weak_ptr<const ComputePipeline>> of_texts;  // that are no files
};

namespace {

std::string key_of(const KernelSource& source) {
  std::string key = fmt::format("{} {} {} {}", source.file, source.group_size, source.subgroup_size, source.robust);
  for (const auto& [name, value] : source.defines) key += fmt::format(" {}={}", name, value);
  for (const auto& [id, value] : source.constants) key += fmt::format(" {}:{}", id, value);
  return key + source.text;
}

Pipelines& pipelines_in(Context& gpu) {
  if (!gpu.pipelines()) gpu.pipelines() = std::make_shared<Pipelines>();
  return *gpu.pipelines();
}

Pipelines::Entry& entry_of(Context& gpu, const KernelSource& source) {
  return pipelines_in(gpu).by_source[key_of(source)];
}

}  // namespace

// CPU devices make every pipeline anew in each process, and lavapipe 22.3.6 inlines slowly: if the
/// SPIR-V is inlined already, it makes the pipeline in 0.3 to 0.7 of the time, and the code has the same size within
/// 0.5 %.
Spirv compiled(Context& gpu, const KernelSource& source) {
  const Calls calls = gpu.info().is_cpu() ? Calls::Inlined : Calls::Kept;
  Spirv spirv =
      compile_shader(source.file, defines_of(source, gpu.info()), true, calls, {source.text, "kernel " + source.name});
  if (!spirv.from_cache) gpu.note_compiled();
  return spirv;
}

std::shared_ptr<const ComputePipeline> pipeline_of(Context& gpu, const KernelSource& source) {
  if (!source.text.empty()) {
    auto& of_texts = pipelines_in(gpu).of_texts;
    std::erase_if(of_texts, [](const auto& one) { return one.second.expired(); });
    std::weak_ptr<const ComputePipeline>& known = of_texts[key_of(source)];
    Pipelines::Made made = known.lock();
    if (!made) known = made = std::make_shared<const ComputePipeline>(gpu, source, compiled(gpu, source));
    return made;
  }
  Pipelines::Entry& entry = entry_of(gpu, source);
  if (entry.coming.valid()) entry.made = entry.coming.get();
  if (!entry.made) entry.made = std::make_shared<const ComputePipeline>(gpu, source, compiled(gpu, source));
  return entry.made;
}

void prepare_pipeline(Context& gpu, const KernelSource& source) {
  Pipelines::Entry& entry = entry_of(gpu, source);
  if (entry.made || entry.coming.valid()) return;
  ++gpu.preparing();
  const auto done = [&gpu](void*) { --gpu.preparing(); };
  entry.coming = std::async(std::launch::async, [&gpu, source, done]() -> Pipelines::Made {
    const std::unique_ptr<void, decltype(done)> preparing(&gpu, done);
    return std::make_shared<const ComputePipeline>(gpu, source, compiled(gpu, source));
  });
}

}  // namespace ballot
