// The Vulkan device: lists devices, chooses one and refuses others with reasons, submits work and collects validation
// messages.
#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/gpu/commands.h"
#include "engine/gpu/given.h"

namespace ballot {

// What a context keeps for them, who alone know it.
struct Pipelines;
struct Staging;
class StreamRing;

/// The drivers that Ballot treats differently from others.
enum class Driver { Other, Llvmpipe, Nvidia };

/// The properties and features of a device that matter to Ballot.
struct DeviceInfo {
  std::string name;
  std::string driver;  // "NVIDIA 580.159.04", "llvmpipe Mesa 22.3.6 (LLVM 15.0.6)"
  VkDriverId driver_id = VkDriverId(0);
  std::uint32_t driver_version = 0;  // as the driver reports it; see mesa_version()
  std::uint32_t vendor_id = 0, device_id = 0;
  std::uint8_t pipeline_cache_uuid[VK_UUID_SIZE] = {};
  VkPhysicalDeviceType type = VK_PHYSICAL_DEVICE_TYPE_OTHER;
  std::uint32_t api_version = 0;
  std::uint32_t subgroup_size = 0, min_subgroup_size = 0, max_subgroup_size = 0;
  std::uint32_t max_group_invocations = 0, max_group_size_x = 0, max_group_count_x = 0, max_group_subgroups = 0;
  std::uint64_t max_storage_range = 0;    // bytes that a storage buffer binding may cover
  std::uint32_t max_storage_buffers = 0;  // that a kernel can have bound
  std::uint64_t max_texels = 0;           // elements of a texel buffer
  std::uint64_t max_allocation = 0;       // bytes that surely can be allocated at once
  std::uint64_t max_buffer = 0;           // bytes; beyond max_allocation a GPU's driver may say that it has no room
  std::uint32_t shared_bytes = 0;         // bytes of shared memory for a workgroup
  std::uint32_t timestamp_bits = 0;
  double timestamp_ns = 0;                            // nanoseconds per tick; 0: no timestamps
  bool size_control = false, full_subgroups = false;  // VK_EXT_subgroup_size_control
  bool uniform_flow = false;                          // VK_KHR_shader_subgroup_uniform_control_flow
  bool shuffle = false, arithmetic = false, buffer_address = false, float64 = false;
  bool pipeline_statistics = false;  // VK_KHR_pipeline_executable_properties
  bool fault_reports = false;        // VK_EXT_device_fault: a lost device tells why
  bool pipeline_robustness = false;  // VK_EXT_pipeline_robustness: kernels may keep indices within buffers
  bool memory_fd = false;            // VK_KHR_external_memory_fd: other interfaces can use its memory
  // VK_EXT_external_memory_host: the device can use memory of the host in place. It imports whole multiples of
  // host_page (0: it cannot), in which buffers begin at multiples of buffer_alignment.
  std::uint64_t host_page = 0, buffer_alignment = 0;
  std::uint8_t uuid[VK_UUID_SIZE] = {};  // of the device, equal in every interface that knows it
  std::vector<std::string> refusals;     // reasons why Ballot cannot use the device; empty: it can
  std::vector<std::string> lacks;        // optional features that it lacks, and what that costs

  bool is_cpu() const { return type == VK_PHYSICAL_DEVICE_TYPE_CPU; }
  /// Returns true for a GPU with memory of its own.
  bool is_discrete() const { return type == VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU; }
  Driver known_driver() const;
  /// Returns true if kernels that ask for it (KernelSource::robust) keep indices within their storage buffers. Mesa's
  /// llvmpipe does so in every kernel.
  bool robust_buffers() const { return pipeline_robustness || known_driver() == Driver::Llvmpipe; }
  /// Returns the version of a Mesa driver as a number (22.3.6 as 220306), or 0 for other drivers.
  std::uint32_t mesa_version() const;
};

/// Returns all Vulkan devices of this machine, usable or not, in the order of the loader. Throws Error(Device) if there
/// is no loader or no driver.
std::vector<DeviceInfo> list_devices();

/// A window that the device must be able to present to. The window must outlive the Context.
struct WindowSurface {
  std::vector<const char*> instance_extensions;    // which surfaces of this window system need
  std::function<VkSurfaceKHR(VkInstance)> create;  // throws Error
};

struct ContextOptions {
  std::string device;                     // "": the best GPU, else a CPU device; an index; part of a name; "gpu"; "cpu"
  bool validate = false;                  // VK_LAYER_KHRONOS_validation with synchronization validation
  const WindowSurface* window = nullptr;  // window that the device must present to; null: none
  bool statistics = false;                // pipelines keep the driver's statistics of them (registers, ...)
  const GivenVulkan* given = nullptr;     // a program's device, with none of the above; null: Ballot opens one
};

/// Returns the index in `devices` of the best usable device that `wanted` names (ContextOptions::device). Throws
/// Error(Arguments) if no device has this name or index. Throws Error(Device), which lists every refusal, if none of
/// them is usable.
std::size_t choose_device(const std::vector<DeviceInfo>& devices, std::string_view wanted);

/// A Vulkan instance, a device and one queue with compute: its own, or a program's (GivenVulkan). Contexts share no
/// state, so each may have a thread of its own; one context belongs to one thread at a time.
///
/// Work is a sequence of passes. Passes run in the order in which they were recorded, and each sees everything that
/// those before it wrote. Many passes are submitted together, while the host records the next ones. At most two
/// submissions are in flight. Every access to a buffer from the host waits for all passes first, so batching changes
/// the speed but never the results.
///
/// A device that is lost stays lost: the call that meets the loss, and every later one that needs the device, throws
/// the same DeviceLost, which names the work, and what the driver reports if it has VK_EXT_device_fault. Objects may
/// still be destroyed. To go on, make another Context.
class Context {
 public:
  explicit Context(const ContextOptions& options = {});
  ~Context();
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  const DeviceInfo& info() const { return info_; }
  /// The Vulkan functions of this device: gpu.vk().QueueSubmit(...).
  const Vulkan& vk() const { return vk_; }
  VkInstance instance() const { return instance_; }
  VkDevice device() const { return device_; }
  VkPipelineCache pipeline_cache() const { return pipeline_cache_; }
  VkPhysicalDevice physical() const { return physical_; }
  VkSurfaceKHR surface() const { return surface_; }  // null without a window
  VkQueue queue() const { return queue_; }
  std::uint32_t queue_family() const { return queue_family_; }
  bool keeps_statistics() const { return statistics_; }
  bool validating() const { return messenger_ != VK_NULL_HANDLE; }
  /// Returns true if the device is a program's.
  bool is_given() const { return given_.has_value(); }

  using Record = std::function<void(Commands&)>;
  using Done = std::function<void(double ms)>;

  /// Records a pass after all earlier ones. `what` names the work in errors (above all if the device is lost). After
  /// the pass has run, and at the latest in finish(), `done` is called with its device time in milliseconds. If the
  /// queue has no timestamps or batching is off (set_batches), every pass is submitted alone and waited for. Without
  /// timestamps `done` gets the wall time.
  void pass(const std::string& what, const Record& record, Done done = {});
  /// Returns how many submissions are in flight: 0 to 2.
  std::size_t in_flight();
  /// Submits what is recorded, without waiting for it; if two submissions are in flight, waits for the first of them.
  /// Returns the number of the submission, or 0 if nothing was recorded.
  std::uint64_t flush();
  /// Returns true if this submission and all before it have ended, without waiting. Submits what is recorded if the
  /// device has room for it.
  bool has_ended(std::uint64_t submission);
  /// Waits for this submission and all before it.
  void wait(std::uint64_t submission);
  /// Waits for everything that was recorded.
  void finish();
  /// Waits for all submissions after a failure, and drops what is recorded. Calls no `done`. Never throws.
  void abandon() noexcept;

  /// Throws as vk_check(). If the device is lost, notes that, and `what` was done to `object` then.
  void check(VkResult result, const char* what, const char* object = "");
  /// Returns true if the device is lost.
  bool is_lost() const { return !lost_.empty(); }
  /// Waits until the device has nothing to do, its presentation included. Throws as vk_check(); `what` names the work.
  void wait_idle(const char* what) const;
  /// Waits for a fence, however long it takes.
  VkResult wait_for(VkFence fence) const;

  /// Records a pass and waits for it.
  void submit(const std::string& what, const Record& record);
  /// Device time in milliseconds of the last submit(); wall time if the queue has no timestamps.
  double last_ms() const { return last_ms_; }

  /// True if passes are submitted together.
  bool batches() const { return batches_ && queue_times(); }
  /// For tests: turns batching off, so that every pass is submitted alone and waited for, or on again.
  void set_batches(bool on) { batches_ = on; }
  /// The milliseconds that one launch of a traversal kernel should take at most; 0: it may take any time. A GPU is
  /// given 50, so that what is slower than the rays before it still ends within 100.
  double launch_ms() const { return launch_ms_; }
  /// For tests: another time, on any device.
  void set_launch_ms(double ms) { launch_ms_ = ms; }
  /// True if the host may answer a few questions in the place of a CPU device (answer/host_walk.h).
  bool answers_few() const { return answers_few_ && info_.is_cpu(); }
  /// For tests: the device answers all.
  void set_answers_few(bool on) { answers_few_ = on; }
  /// For tests: smaller limits, as if the device had them. Call it before anything is made.
  void lower_limits(std::uint64_t texels, std::uint64_t storage_bytes);
  /// A pass that has ended.
  struct Timed {
    std::string what;
    double ms = 0;  // on the device
  };
  /// Returns the pass that took longest so far. Systems give up devices whose dispatches take seconds.
  const Timed& longest_pass() const { return longest_; }
  std::uint64_t submissions() const { return submitted_; }
  /// The numbers of the submission that is recorded now or next, and of the last one that has ended.
  std::uint64_t recording() const { return submitted_ + 1; }
  /// Returns true if passes are recorded that are not submitted yet.
  bool has_recorded() const { return slots_[slot_].open; }
  std::uint64_t ended() const { return ended_; }
  /// Device time in milliseconds of the last submission that has ended.
  double ended_ms() const { return ended_ms_; }

  /// Returns a memory type among `bits` that has all `wanted` flags, and the `preferred` flags too if possible. Throws
  /// Error(Work) if there is none.
  std::uint32_t memory_type(std::uint32_t bits, VkMemoryPropertyFlags wanted, VkMemoryPropertyFlags preferred) const;
  VkMemoryPropertyFlags memory_flags(std::uint32_t type) const { return memory_.memoryTypes[type].propertyFlags; }
  /// Returns the bytes of the memory that the device works in.
  std::uint64_t own_memory() const { return heap_bytes(memory_type(~0u, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT, 0)); }
  std::uint64_t heap_bytes(std::uint32_t type) const {
    return memory_.memoryHeaps[memory_.memoryTypes[type].heapIndex].size;
  }

  /// Names an object in validation messages. No effect without validation.
  void name(VkObjectType type, std::uint64_t handle, const std::string& name);
  /// Takes back the name of an object that is destroyed next: the layers keep names until then.
  void unname(VkObjectType type, std::uint64_t handle);

  /// Warnings and errors of the validation layers so far; the messages are also printed to standard error.
  const std::vector<std::string>& messages() const { return messages_; }

  /// The staging buffer of all buffers (buffer.cpp), made on first use.
  std::shared_ptr<Staging>& staging() { return staging_; }

  /// The buffers that streams of rays go through (answer/stream.h), made on first use.
  std::shared_ptr<StreamRing>& stream_ring() { return stream_ring_; }

  /// The pipelines of this context (pipeline.cpp), made on first use.
  std::shared_ptr<Pipelines>& pipelines() { return pipelines_; }

  /// Marks all kernels made so far as out of date. If a kernel then fails to compile, its message is kept here and the
  /// kernel before it stays in use (kernel.h, refresh).
  void reload_shaders() { ++shader_generation_, shader_error_.clear(), pipelines_.reset(); }
  std::uint64_t shader_generation() const { return shader_generation_; }
  const std::string& shader_error() const { return shader_error_; }
  void set_shader_error(std::string text) { shader_error_ = std::move(text); }

  /// Notes that a shader was compiled: the driver may then write its own caches in the background. Thread-safe.
  void note_compiled() { compiled_ = true; }
  /// Returns true if a shader was compiled, and not only loaded from the cache, or if a pipeline is being made.
  bool has_compiled() const { return compiled_ || preparing_ > 0; }
  /// Counts the pipelines that other threads are making. Thread-safe.
  std::atomic<int>& preparing() { return preparing_; }

  /// Returns a number that no other buffer of this context ever has.
  std::uint64_t next_buffer_id() { return ++buffers_; }

  /// Stores the pipelines if there are new ones. Call it after some were made. A failure to write is ignored.
  void save_pipeline_cache();

 private:
  void open(const ContextOptions& options);
  void adopt(const GivenVulkan& given);
  VkResult submit_to_queue(const VkSubmitInfo& submit, VkFence fence);
  void create_instance(const ContextOptions& options);
  void create_device();
  /// The Vulkan objects of one submission at a time: it is recorded, then in flight, then ended.
  struct Slot {
    VkCommandPool pool = VK_NULL_HANDLE;
    VkCommandBuffer commands = VK_NULL_HANDLE;
    VkFence fence = VK_NULL_HANDLE;
    VkQueryPool queries = VK_NULL_HANDLE;  // a timestamp at the beginning, and one after every pass
    std::vector<Done> passes;
    std::vector<std::string> names;  // of the passes
    std::string what;                // the name of the one that is recorded, or was last
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
  void expect_device() const;
  std::string passes_of(const Slot& slot) const;
  std::string fault_report() const;
  void load_pipeline_cache();
  std::size_t pipeline_cache_bytes() const;
  void destroy();

  Vulkan vk_;
  DeviceInfo info_;
  std::vector<std::string> messages_;
  std::optional<GivenVulkan> given_;
  VkInstance instance_ = VK_NULL_HANDLE;
  bool bare_ = true;  // the instance has neither layers nor extensions
  VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
  VkPhysicalDevice physical_ = VK_NULL_HANDLE;
  VkPhysicalDeviceMemoryProperties memory_{};
  VkSurfaceKHR surface_ = VK_NULL_HANDLE;
  VkDevice device_ = VK_NULL_HANDLE;
  std::uint32_t queue_family_ = 0;
  VkQueue queue_ = VK_NULL_HANDLE;
  std::array<Slot, 3> slots_;  // taken in turn: two in flight, one that is recorded
  std::size_t slot_ = 0;       // index of the slot that is recorded now or next
  std::uint64_t submitted_ = 0, ended_ = 0;
  bool batches_ = true, answers_few_ = true;
  double launch_ms_ = 0;
  VkPipelineCache pipeline_cache_ = VK_NULL_HANDLE;
  std::size_t stored_bytes_ = 0;  // size of the driver's data in the file, as far as this process knows; 0: none
  std::shared_ptr<Staging> staging_;
  std::shared_ptr<StreamRing> stream_ring_;
  std::shared_ptr<Pipelines> pipelines_;
  bool statistics_ = false;
  double last_ms_ = 0, ended_ms_ = 0;
  Timed longest_;
  std::uint64_t shader_generation_ = 0, buffers_ = 0;
  std::atomic<bool> compiled_ = false;
  std::atomic<int> preparing_ = 0;
  std::string shader_error_;
  std::string lost_;  // why the device was lost; "" as long as it is not
};

/// Waits for all work in flight when a scope is left, also by an exception, before the objects that its passes use are
/// destroyed.
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
