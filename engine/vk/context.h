// The Vulkan device: choosing one, refusing the rest with reasons, submitting work, collecting validation messages.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "engine/vk/api.h"

namespace ballot {

/// What a device is and offers, as far as Ballot cares.
struct DeviceInfo {
  std::string name;
  std::string driver;  // "NVIDIA 580.159.04", "llvmpipe Mesa 22.3.6 (LLVM 15.0.6)"
  VkDriverId driver_id = VkDriverId(0);
  std::uint32_t driver_version = 0;  // raw; see mesa_version()
  std::uint32_t vendor_id = 0, device_id = 0;
  std::uint8_t pipeline_cache_uuid[VK_UUID_SIZE] = {};
  VkPhysicalDeviceType type = VK_PHYSICAL_DEVICE_TYPE_OTHER;
  std::uint32_t api_version = 0;
  std::uint32_t subgroup_size = 0, min_subgroup_size = 0, max_subgroup_size = 0;
  std::uint32_t max_group_invocations = 0, max_group_size_x = 0, max_group_count_x = 0, max_group_subgroups = 0;
  std::uint64_t max_storage_range = 0;  // bytes a storage buffer binding may see
  std::uint64_t max_texels = 0;         // elements of a texel buffer
  std::uint64_t max_allocation = 0;     // bytes
  std::uint32_t shared_bytes = 0;
  std::uint32_t timestamp_bits = 0;
  double timestamp_ns = 0;                            // per tick; 0: no timestamps
  bool size_control = false, full_subgroups = false;  // VK_EXT_subgroup_size_control
  bool uniform_flow = false;                          // VK_KHR_shader_subgroup_uniform_control_flow
  bool shuffle = false, arithmetic = false, buffer_address = false, float64 = false;
  bool pipeline_statistics = false;   // VK_KHR_pipeline_executable_properties
  std::vector<std::string> refusals;  // why Ballot cannot use it; empty: it can
  std::vector<std::string> lacks;     // optional things it has not, and what that costs

  bool is_cpu() const { return type == VK_PHYSICAL_DEVICE_TYPE_CPU; }
  /// Version of a Mesa driver as 22.3.6 -> 220306; 0 for other drivers.
  std::uint32_t mesa_version() const;
};

/// All Vulkan devices of this machine, usable or not, in the loader's order. Throws Error(Device) without a
/// loader/driver.
std::vector<DeviceInfo> list_devices();

/// What a window gives so that a device can present to it. The caller keeps the window alive as long as the Context.
struct WindowSurface {
  std::vector<const char*> instance_extensions;    // that surfaces of this window system need
  std::function<VkSurfaceKHR(VkInstance)> create;  // throws Error
};

struct ContextOptions {
  std::string device;                     // "": the best GPU, else a CPU device; an index; part of a name; "gpu"; "cpu"
  bool validate = false;                  // VK_LAYER_KHRONOS_validation with synchronization validation
  const WindowSurface* window = nullptr;  // the device must present to it; null: no window
  bool statistics = false;                // pipelines keep what the driver tells of them (registers, ...)
};

/// Index into `devices` of the one that `wanted` names. Throws Error(Arguments) if nothing has this name or index,
/// Error(Device) that lists every refusal if nothing usable is left.
std::size_t choose_device(const std::vector<DeviceInfo>& devices, std::string_view wanted);

/// Instance, device, one queue with compute. Belongs to one thread; one lives at a time.
///
/// Work is a sequence of passes. They run in the order in which they were recorded, each seeing all that those before it wrote,
/// and many go to the device together, while the host records the next ones: two submissions are under way at most. Whatever
/// reads or writes a buffer from the host waits for all passes first, so what is not waited for is a matter of speed alone.
class Context {
 public:
  explicit Context(const ContextOptions& options = {});
  ~Context();
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  const DeviceInfo& info() const { return info_; }
  /// The functions of this device. Calls go through it: gpu.vk().QueueSubmit(...).
  const Vulkan& vk() const { return vk_; }
  VkDevice device() const { return device_; }
  VkPipelineCache pipeline_cache() const { return pipeline_cache_; }
  VkPhysicalDevice physical() const { return physical_; }
  VkSurfaceKHR surface() const { return surface_; }  // null without a window
  VkQueue queue() const { return queue_; }
  std::uint32_t queue_family() const { return queue_family_; }
  bool keeps_statistics() const { return statistics_; }
  bool validating() const { return messenger_ != VK_NULL_HANDLE; }

  using Record = std::function<void(VkCommandBuffer)>;
  using Done = std::function<void(double ms)>;

  /// Records commands behind all earlier ones. `what` names the work in errors (a lost device above all). Once it has run,
  /// and at the latest in finish(), `done` is told its device milliseconds. A queue without timestamps, or one told not to
  /// batch, runs every pass by itself and waits for it; without timestamps `done` is told wall time.
  void pass(const std::string& what, const Record& record, Done done = {});
  /// Hands what is recorded to the device, without waiting for it. Names the submission; 0: there was nothing.
  std::uint64_t flush();
  /// Waits for a submission and those before it.
  void wait(std::uint64_t submission);
  /// Waits for everything that was recorded.
  void finish();
  /// The same after a failure: nobody is told of times. Never throws.
  void abandon() noexcept;

  /// Makes writes of earlier dispatches and copies visible to later dispatches, to their indirect arguments, and to copies.
  void memory_barrier(VkCommandBuffer cmd) const;

  /// A pass that is waited for.
  void submit(const std::string& what, const Record& record);
  /// Device milliseconds of the last submit; wall time where the queue has no timestamps.
  double last_ms() const { return last_ms_; }

  bool batches() const { return batches_ && queue_times(); }
  /// Tests: every pass is to be waited for, so that nothing rests on what is recorded together.
  void set_batches(bool on) { batches_ = on; }
  std::uint64_t submissions() const { return submitted_; }
  /// The submission that is recorded now or next; and the last one that has ended.
  std::uint64_t recording() const { return submitted_ + 1; }
  std::uint64_t ended() const { return ended_; }
  /// Device milliseconds of the last submission that has ended.
  double ended_ms() const { return ended_ms_; }

  /// Memory type with `wanted` flags among `bits`, preferring `preferred` too. Throws Error(Work).
  std::uint32_t memory_type(std::uint32_t bits, VkMemoryPropertyFlags wanted, VkMemoryPropertyFlags preferred) const;
  VkMemoryPropertyFlags memory_flags(std::uint32_t type) const { return memory_.memoryTypes[type].propertyFlags; }
  std::uint64_t heap_bytes(std::uint32_t type) const {
    return memory_.memoryHeaps[memory_.memoryTypes[type].heapIndex].size;
  }

  /// Names an object in validation messages. No effect without validation.
  void name(VkObjectType type, std::uint64_t handle, const std::string& name);

  /// Warnings and errors of the validation layers so far; the messages are also printed to standard error.
  const std::vector<std::string>& messages() const { return messages_; }

  /// Where the buffers keep what they copy through; made on first use.
  std::shared_ptr<void>& staging() { return staging_; }

  /// Where the pipelines are kept (pipeline.h); made on first use.
  std::shared_ptr<void>& pipelines() { return pipelines_; }

  /// Kernels made before the last reload_shaders() are out of date. A kernel that then fails to compile leaves its
  /// message here and the one before it in use (kernel.h, refresh).
  void reload_shaders() { ++shader_generation_, shader_error_.clear(), pipelines_.reset(); }
  std::uint64_t shader_generation() const { return shader_generation_; }
  const std::string& shader_error() const { return shader_error_; }
  void set_shader_error(std::string text) { shader_error_ = std::move(text); }

  /// A number that no other buffer of this context has, ever.
  std::uint64_t next_buffer_id() { return ++buffers_; }

  void save_pipeline_cache();  // when pipelines were made; failure to write is ignored

 private:
  void create_instance(const ContextOptions& options);
  void create_device();
  /// What one submission at a time goes through: recorded, under way, ended.
  struct Slot {
    VkCommandPool pool = VK_NULL_HANDLE;
    VkCommandBuffer commands = VK_NULL_HANDLE;
    VkFence fence = VK_NULL_HANDLE;
    VkQueryPool queries = VK_NULL_HANDLE;  // a timestamp at the begin, and one behind every pass
    std::vector<Done> passes;
    std::string what;  // its last pass
    bool open = false, under_way = false;
    std::uint64_t submission = 0;
    std::chrono::steady_clock::time_point start;
  };
  void create_slot(Slot& slot);
  void destroy_slot(Slot& slot);
  Slot& open_slot(const std::string& what);
  void end_pass(Slot& slot, Done done);
  void end_slot(Slot& slot);
  std::vector<double> times_of(Slot& slot);
  bool queue_times() const { return info_.timestamp_ns > 0; }
  void load_pipeline_cache();
  void destroy();

  Vulkan vk_;
  DeviceInfo info_;
  std::vector<std::string> messages_;
  VkInstance instance_ = VK_NULL_HANDLE;
  VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
  VkPhysicalDevice physical_ = VK_NULL_HANDLE;
  VkPhysicalDeviceMemoryProperties memory_{};
  VkSurfaceKHR surface_ = VK_NULL_HANDLE;
  VkDevice device_ = VK_NULL_HANDLE;
  std::uint32_t queue_family_ = 0;
  VkQueue queue_ = VK_NULL_HANDLE;
  std::array<Slot, 2> slots_;  // taken in turn
  std::size_t slot_ = 0;       // that is recorded now or next
  std::uint64_t submitted_ = 0, ended_ = 0;
  bool batches_ = true;
  VkPipelineCache pipeline_cache_ = VK_NULL_HANDLE;
  std::shared_ptr<void> staging_, pipelines_;
  bool statistics_ = false;
  double last_ms_ = 0, ended_ms_ = 0;
  std::uint64_t shader_generation_ = 0, buffers_ = 0;
  std::string shader_error_;
};

/// Ends all that is under way when a scope is left by an exception, before what its passes refer to goes.
class PassScope {
 public:
  explicit PassScope(Context& gpu) : gpu_(gpu) {}
  ~PassScope() { gpu_.abandon(); }
  PassScope(const PassScope&) = delete;
  PassScope& operator=(const PassScope&) = delete;

 private:
  Context& gpu_;
};

}  // namespace ballot
