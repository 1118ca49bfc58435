#include "engine/gpu/context.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/memory.h"
#include "engine/core/parallel.h"
#include "engine/gpu/device.h"

namespace ballot {

namespace {

/// Has a child of fork() that opens devices, as its parent did, end before the driver does. Mesa would join threads by
/// handles of the parent's, which may be those of other threads here by now, and wait for ever.
void end_before_the_driver() {
  static const pid_t first = getpid();  // in which the driver was loaded
  static pid_t told = first;
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  if (std::exchange(told, getpid()) == getpid()) return;
  on_exit(
      [](int status, void* opened_in) {
        if (pid_t(reinterpret_cast<std::intptr_t>(opened_in)) != getpid()) return;
        std::fflush(nullptr);
        _exit(status);
      },
      reinterpret_cast<void*>(std::intptr_t(getpid())));
}

constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";

bool has_validation_layer() {
  std::uint32_t count = 0;
  vulkan_loader().EnumerateInstanceLayerProperties(&count, nullptr);
  std::vector<VkLayerProperties> layers(count);
  vulkan_loader().EnumerateInstanceLayerProperties(&count, layers.data());
  for (const auto& layer : layers)
    if (!std::strcmp(layer.layerName, kValidationLayer)) return true;
  return false;
}

VKAPI_ATTR VkBool32 VKAPI_CALL on_message(VkDebugUtilsMessageSeverityFlagBitsEXT, VkDebugUtilsMessageTypeFlagsEXT,
                                          const VkDebugUtilsMessengerCallbackDataEXT* data, void* user) {
  static_cast<std::vector<std::string>*>(user)->push_back(data->pMessage);
  std::fprintf(stderr, "validation: %s\n", data->pMessage);
  return VK_FALSE;
}

VkDebugUtilsMessengerCreateInfoEXT messenger_info(std::vector<std::string>* messages) {
  VkDebugUtilsMessengerCreateInfoEXT info{};
  info.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT;
  info.messageSeverity =
      VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
  info.messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT | VK_DEBUG_UTILS_MESSAGE_TYPE_PERFORMANCE_BIT_EXT;
  info.pfnUserCallback = on_message;
  info.pUserData = messages;
  return info;
}

// The address space that Mesa's CPU driver takes (22.3.6 with LLVM 15) beside its threads: to be loaded, and to compile
// the first kernels too.
constexpr std::uint64_t kListing = 192 << 20, kOpening = 384 << 20;

/// Asks for a driver's address space before it is loaded. Throws Error(Device).
void ask_for_driver(std::uint64_t bytes) {
  spare_address_space();
  need_driver_space(bytes, std::min<std::size_t>(core_count(), 32), "a Vulkan driver");
}

VkApplicationInfo application() {
  VkApplicationInfo app{};
  app.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO;
  app.pApplicationName = "ballot";
  app.apiVersion = VK_API_VERSION_1_2;
  return app;
}

/// Returns an instance without layers and extensions; null if there is none.
VkInstance bare_instance() {
  const VkApplicationInfo app = application();
  VkInstanceCreateInfo create{};
  create.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
  create.pApplicationInfo = &app;
  VkInstance instance = VK_NULL_HANDLE;
  return vulkan_loader().CreateInstance(&create, nullptr, &instance) == VK_SUCCESS ? instance : VK_NULL_HANDLE;
}

/// Destroys an instance, but keeps one of the process until that ends, so that the drivers stay loaded: this one if it
/// is bare, else another. NVIDIA's driver (580.159.04) leaks thread-local storage each time that it is unloaded, so
/// that the 31st instance of a process finds no driver. It stays loaded as long as there is an instance.
void end_instance(const Vulkan& vk, VkInstance instance, bool bare) {
  static std::mutex mutex;
  static VkInstance kept = VK_NULL_HANDLE;
  const std::lock_guard lock(mutex);
  if (!kept) kept = bare ? std::exchange(instance, VK_NULL_HANDLE) : bare_instance();
  if (instance) vk.DestroyInstance(instance, nullptr);
}

VkInstance make_instance(Vulkan& vk, bool validate, std::vector<std::string>* messages,
                         const WindowSurface* window = nullptr) {
  std::uint32_t version = 0;
  vulkan_loader().EnumerateInstanceVersion(&version);
  if (version < VK_API_VERSION_1_2) fail(Failure::Device, "the Vulkan loader is older than 1.2; update libvulkan1");
  if (validate && !has_validation_layer())
    fail(Failure::Device, "validation: the layer {} is not installed; on Debian: apt install vulkan-validationlayers",
         kValidationLayer);
  const VkApplicationInfo app = application();
  VkInstanceCreateInfo create{};
  create.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
  create.pApplicationInfo = &app;
  const VkValidationFeatureEnableEXT enable = VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT;
  VkValidationFeaturesEXT features{};
  features.sType = VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT;
  features.enabledValidationFeatureCount = 1;
  features.pEnabledValidationFeatures = &enable;
  std::vector<const char*> extensions = window ? window->instance_extensions : std::vector<const char*>();
  auto messenger = messenger_info(messages);
  if (validate) {
    features.pNext = &messenger;
    create.pNext = &features;
    create.enabledLayerCount = 1;
    create.ppEnabledLayerNames = &kValidationLayer;
    extensions.push_back(VK_EXT_DEBUG_UTILS_EXTENSION_NAME);
    extensions.push_back(VK_EXT_VALIDATION_FEATURES_EXTENSION_NAME);
  }
  create.enabledExtensionCount = std::uint32_t(extensions.size());
  create.ppEnabledExtensionNames = extensions.data();
  end_before_the_driver();
  VkInstance instance = VK_NULL_HANDLE;
  const VkResult result = vulkan_loader().CreateInstance(&create, nullptr, &instance);
  if (result == VK_ERROR_INCOMPATIBLE_DRIVER) fail_without_driver();
  if (result != VK_SUCCESS) fail(Failure::Device, "no Vulkan instance: {}", result_name(result));
  vk.load_instance(instance, vulkan_loader().GetInstanceProcAddr, validate, window != nullptr);
  return instance;
}

void refuse_without_present(const Vulkan& vk, std::vector<PhysicalDevice>& devices, VkSurfaceKHR surface) {
  for (PhysicalDevice& d : devices)
    if (d.info.refusals.empty() && present_family(vk, d.handle, surface) < 0)
      d.info.refusals.push_back("it cannot present to this window");
}

}  // namespace

std::vector<DeviceInfo> list_devices() {
  ask_for_driver(kListing);
  Vulkan vk;
  const VkInstance instance = make_instance(vk, false, nullptr);
  std::vector<DeviceInfo> infos;
  for (PhysicalDevice& d : physical_devices(vk, instance)) infos.push_back(std::move(d.info));
  end_instance(vk, instance, true);
  return infos;
}

Context::Context(const ContextOptions& options) {
  ask_for_driver(kOpening);
  try {
    if (options.given)
      adopt(*options.given);
    else
      open(options);
    launch_ms_ = info_.is_cpu() ? 0 : 50;
    vk_.GetPhysicalDeviceMemoryProperties(physical_, &memory_);
    for (Slot& slot : slots_) create_slot(slot);
    load_pipeline_cache();
  } catch (...) {
    destroy();
    throw;
  }
}

void Context::open(const ContextOptions& options) {
  create_instance(options);
  auto devices = physical_devices(vk_, instance_);
  if (surface_) refuse_without_present(vk_, devices, surface_);
  std::vector<DeviceInfo> infos;
  for (const auto& d : devices) infos.push_back(d.info);
  PhysicalDevice& chosen = devices[choose_device(infos, options.device)];
  physical_ = chosen.handle;
  info_ = std::move(chosen.info);
  queue_family_ = std::uint32_t(surface_ ? present_family(vk_, physical_, surface_) : compute_family(vk_, physical_));
  // lavapipe bins timestamps with draw commands, so with a window they do not measure dispatches (22.3.6).
  if (surface_ && info_.is_cpu()) info_.timestamp_ns = 0;
  statistics_ = options.statistics && info_.pipeline_statistics;
  create_device();
}

Context::~Context() { destroy(); }

void Context::destroy() {
  if (device_) {
    abandon();
    if (!given_) vk_.QueueWaitIdle(queue_);
    staging_.reset();
    stream_ring_.reset();
    pipelines_.reset();
    vk_.DestroyPipelineCache(device_, pipeline_cache_, nullptr);
    for (Slot& slot : slots_) destroy_slot(slot);
    if (!given_) vk_.DestroyDevice(device_, nullptr);
    device_ = VK_NULL_HANDLE;
  }
  if (surface_) vk_.DestroySurfaceKHR(instance_, surface_, nullptr);
  surface_ = VK_NULL_HANDLE;
  if (messenger_) vk_.DestroyDebugUtilsMessengerEXT(instance_, messenger_, nullptr);
  messenger_ = VK_NULL_HANDLE;
  if (instance_) end_instance(vk_, instance_, bare_);
  instance_ = VK_NULL_HANDLE;
}

void Context::create_instance(const ContextOptions& options) {
  bare_ = !options.validate && !options.window;
  instance_ = make_instance(vk_, options.validate, &messages_, options.window);
  if (options.validate) {
    const auto info = messenger_info(&messages_);
    vk_check(vk_.CreateDebugUtilsMessengerEXT(instance_, &info, nullptr, &messenger_),
             "creating the validation messenger");
  }
  if (options.window) surface_ = options.window->create(instance_);
}

void Context::create_device() {
  const float priority = 1;
  VkDeviceQueueCreateInfo queue{};
  queue.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO;
  queue.queueFamilyIndex = queue_family_;
  queue.queueCount = 1;
  queue.pQueuePriorities = &priority;
  VkPhysicalDeviceShaderSubgroupUniformControlFlowFeaturesKHR flow{};
  flow.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SHADER_SUBGROUP_UNIFORM_CONTROL_FLOW_FEATURES_KHR;
  flow.shaderSubgroupUniformControlFlow = VK_TRUE;
  VkPhysicalDeviceSubgroupSizeControlFeaturesEXT size{};
  size.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SUBGROUP_SIZE_CONTROL_FEATURES_EXT;
  size.pNext = info_.uniform_flow ? &flow : nullptr;
  size.subgroupSizeControl = info_.size_control;
  size.computeFullSubgroups = info_.full_subgroups;
  VkPhysicalDevicePipelineExecutablePropertiesFeaturesKHR executables{};
  executables.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PIPELINE_EXECUTABLE_PROPERTIES_FEATURES_KHR;
  executables.pipelineExecutableInfo = VK_TRUE;
  VkPhysicalDeviceVulkan12Features v12{};
  v12.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES;
  v12.pNext = info_.size_control || info_.full_subgroups ? &size : size.pNext;
  v12.scalarBlockLayout = VK_TRUE;
  v12.bufferDeviceAddress = info_.buffer_address;
  VkPhysicalDeviceFaultFeaturesEXT faults{};
  faults.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FAULT_FEATURES_EXT;
  faults.deviceFault = VK_TRUE;
  if (info_.fault_reports) faults.pNext = std::exchange(v12.pNext, &faults);
  VkPhysicalDevicePipelineRobustnessFeaturesEXT robustness{};
  robustness.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PIPELINE_ROBUSTNESS_FEATURES_EXT;
  robustness.pipelineRobustness = VK_TRUE;
  if (info_.pipeline_robustness) robustness.pNext = std::exchange(v12.pNext, &robustness);
  auto extensions = optional_extensions(vk_, physical_);
  if (info_.fault_reports) extensions.push_back(VK_EXT_DEVICE_FAULT_EXTENSION_NAME);
  if (info_.pipeline_robustness) extensions.push_back(VK_EXT_PIPELINE_ROBUSTNESS_EXTENSION_NAME);
  if (surface_) extensions.push_back(VK_KHR_SWAPCHAIN_EXTENSION_NAME);
  VkDeviceCreateInfo create{};
  create.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO;
  VkPhysicalDeviceFeatures core{};
  core.shaderFloat64 = info_.float64;
  create.pNext = &v12;
  if (statistics_) {
    extensions.push_back(VK_KHR_PIPELINE_EXECUTABLE_PROPERTIES_EXTENSION_NAME);
    executables.pNext = &v12;
    create.pNext = &executables;
  }
  create.pEnabledFeatures = &core;
  create.queueCreateInfoCount = 1;
  create.pQueueCreateInfos = &queue;
  create.enabledExtensionCount = std::uint32_t(extensions.size());
  create.ppEnabledExtensionNames = extensions.data();
  vk_check(vk_.CreateDevice(physical_, &create, nullptr, &device_), "opening device", info_.name.c_str());
  vk_.load_device(device_);
  vk_.GetDeviceQueue(device_, queue_family_, 0, &queue_);
}

void Context::lower_limits(std::uint64_t texels, std::uint64_t storage_bytes) {
  info_.max_texels = std::min(info_.max_texels, texels);
  info_.max_storage_range = std::min(info_.max_storage_range, storage_bytes);
}

std::uint32_t Context::memory_type(std::uint32_t bits, VkMemoryPropertyFlags wanted,
                                   VkMemoryPropertyFlags preferred) const {
  for (const VkMemoryPropertyFlags flags : {wanted | preferred, wanted})
    for (std::uint32_t i = 0; i < memory_.memoryTypeCount; ++i)
      if ((bits >> i & 1) && (memory_.memoryTypes[i].propertyFlags & flags) == flags) return i;
  fail(Failure::Work, "device {} has no memory type with flags {:#x}", info_.name, wanted);
}

void Context::unname(VkObjectType type, std::uint64_t handle) {
  if (!messenger_ || handle == 0) return;
  VkDebugUtilsObjectNameInfoEXT info{};
  info.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_OBJECT_NAME_INFO_EXT;
  info.objectType = type;
  info.objectHandle = handle;
  vk_.SetDebugUtilsObjectNameEXT(device_, &info);
}

void Context::name(VkObjectType type, std::uint64_t handle, const std::string& name) {
  if (!messenger_) return;
  VkDebugUtilsObjectNameInfoEXT info{};
  info.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_OBJECT_NAME_INFO_EXT;
  info.objectType = type;
  info.objectHandle = handle;
  info.pObjectName = name.c_str();
  vk_.SetDebugUtilsObjectNameEXT(device_, &info);
}

}  // namespace ballot
