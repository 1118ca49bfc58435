// A compute pipeline and its layouts; kernels that bind different buffers share it.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "engine/vk/context.h"
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

/// What a kernel is compiled with on a device: its own, and BALLOT_TEXEL_RECORDS (shaders/lib/frame/records.glsl).
Defines defines_of(const KernelSource& source, const DeviceInfo& device);

struct KernelTimes {
  double spirv_ms = 0;  // preprocessing and compiling, or loading from the cache
  double pipeline_ms = 0;
  std::size_t spirv_bytes = 0;
  bool from_cache = false;
};

/// What a driver tells of a pipeline, in its own words: "Register Count", 56.
struct PipelineFigure {
  std::string name, text;  // text: what it means
  double value;
};

class ComputePipeline {
 public:
  /// Throws Error(Work) that names the variant on any failure.
  ComputePipeline(Context& gpu, const KernelSource& source);
  ~ComputePipeline();
  ComputePipeline(const ComputePipeline&) = delete;
  ComputePipeline& operator=(const ComputePipeline&) = delete;

  const KernelTimes& times() const { return times_; }
  /// Empty unless the context keeps statistics (ContextOptions) and the driver has them.
  std::vector<PipelineFigure> statistics() const;
  const Reflection& reflection() const { return reflection_; }
  VkDescriptorSetLayout set_layout() const { return set_layout_; }
  VkPipelineLayout layout() const { return layout_; }
  VkPipeline pipeline() const { return pipeline_; }

 private:
  void create(const KernelSource& source, const std::vector<std::uint32_t>& words);
  void create_layout(const std::string& name);
  void create_pipeline(const KernelSource& source, VkShaderModule module);
  void destroy();

  Context& gpu_;
  KernelTimes times_;
  Reflection reflection_;
  VkDescriptorSetLayout set_layout_ = VK_NULL_HANDLE;
  VkPipelineLayout layout_ = VK_NULL_HANDLE;
  VkPipeline pipeline_ = VK_NULL_HANDLE;
};

/// The pipeline of a source, made on first use and kept as long as the context: scenes that come and go on one device share
/// it, and so does what the driver compiles at the first dispatch. Not thread-safe.
std::shared_ptr<const ComputePipeline> pipeline_of(Context& gpu, const KernelSource& source);

}  // namespace ballot
