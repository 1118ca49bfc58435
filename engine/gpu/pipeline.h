// Compute pipelines and their layouts. Dispatches of one kernel share a pipeline, whatever buffers they bind.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "engine/gpu/context.h"
#include "engine/gpu/shader.h"

namespace ballot {

/// A kernel configuration: the source file and everything that it is compiled with.
struct KernelSource {
  std::string name = {};  // of the variant, in debug names, logs and errors
  std::string file = {};  // path under shaders/
  std::string text = {};  // in the place of the file's, which need not be there; its #includes are relative to it
  Defines defines = {};
  std::map<std::uint32_t, std::uint32_t> constants = {};  // specialisation constants by id
  std::uint32_t group_size = 64;                          // invocations in a workgroup
  std::uint32_t subgroup_size = 0;                        // required subgroup size; 0: the driver chooses
  bool robust = false;  // indices are kept within storage buffers, where the device can (DeviceInfo::robust_buffers)
};

/// Returns the defines that a kernel is compiled with on a device: those of its source, and BALLOT_TEXEL_RECORDS
/// (shaders/lib/frame/records.glsl).
Defines defines_of(const KernelSource& source, const DeviceInfo& device);

/// The time that making a kernel took.
struct KernelTimes {
  double spirv_ms = 0;  // compiling, or loading SPIR-V from the cache
  double pipeline_ms = 0;
  std::size_t spirv_bytes = 0;
  bool from_cache = false;
};

/// A statistic of a pipeline, as the driver names it: "Register Count", 56.
struct PipelineFigure {
  std::string name, text;  // text: the driver's description
  double value;
};

/// A compute pipeline with its layouts.
class ComputePipeline {
 public:
  /// Makes the pipeline of a compiled source. On any failure throws Error(Work) that names the variant. May be
  /// called on any thread.
  ComputePipeline(Context& gpu, const KernelSource& source, const Spirv& spirv);
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

/// Compiles a source for a device, or takes it from the cache.
Spirv compiled(Context& gpu, const KernelSource& source);

/// Returns the pipeline of a source. It is made on first use and kept until the context is destroyed or reloads its
/// shaders; that of a text that is no file goes with the last that holds it. So scenes that come and go on one device
/// share it, and with it the code that the driver compiles at the first dispatch. Not thread-safe.
std::shared_ptr<const ComputePipeline> pipeline_of(Context& gpu, const KernelSource& source);

/// Begins to compile a source and to make its pipeline on another thread. pipeline_of() waits for it, and throws
/// Error(Work) if the source does not compile. Does nothing if that was begun or done before. Not thread-safe.
void prepare_pipeline(Context& gpu, const KernelSource& source);

}  // namespace ballot
