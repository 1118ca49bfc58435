#include "engine/gpu/device.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "engine/core/error.h"

namespace ballot {

namespace {

bool has_extension(const std::vector<VkExtensionProperties>& all, const char* name) {
  for (const auto& e : all)
    if (!std::strcmp(e.extensionName, name)) return true;
  return false;
}

std::vector<VkExtensionProperties> extensions_of(const Vulkan& vk, VkPhysicalDevice device) {
  std::uint32_t count = 0;
  vk.EnumerateDeviceExtensionProperties(device, nullptr, &count, nullptr);
  std::vector<VkExtensionProperties> all(count);
  vk.EnumerateDeviceExtensionProperties(device, nullptr, &count, all.data());
  return all;
}

std::vector<VkQueueFamilyProperties> queue_families(const Vulkan& vk, VkPhysicalDevice device) {
  std::uint32_t count = 0;
  vk.GetPhysicalDeviceQueueFamilyProperties(device, &count, nullptr);
  std::vector<VkQueueFamilyProperties> families(count);
  vk.GetPhysicalDeviceQueueFamilyProperties(device, &count, families.data());
  return families;
}

struct Requirement {
  const char* what;
  const char* why;
  bool (*met)(const DeviceProperties&, const DeviceFeatures&);
};

constexpr VkSubgroupFeatureFlags kVotes =
    VK_SUBGROUP_FEATURE_BASIC_BIT | VK_SUBGROUP_FEATURE_VOTE_BIT | VK_SUBGROUP_FEATURE_BALLOT_BIT;

// The features that Ballot requires of a device, with the reason for each. Both are part of the text of a refusal.
constexpr Requirement kRequirements[] = {
    {"scalarBlockLayout", "shaders/shared/layout.h packs records without padding",
     [](const DeviceProperties&, const DeviceFeatures& f) { return f.v12.scalarBlockLayout == VK_TRUE; }},
    {"subgroup operations basic, vote and ballot in compute",
     "the lanes of a subgroup vote on their way through the tree",
     [](const DeviceProperties& p, const DeviceFeatures&) {
       return (p.v11.subgroupSupportedOperations & kVotes) == kVotes &&
              (p.v11.subgroupSupportedStages & VK_SHADER_STAGE_COMPUTE_BIT) != 0;
     }},
    {"a subgroup of 4 to 128 lanes", "packets and votes are sized for these",
     [](const DeviceProperties& p, const DeviceFeatures&) {
       return p.v11.subgroupSize >= 4 && p.v11.subgroupSize <= 128;
     }},
};

void read_limits(DeviceInfo& info, const DeviceProperties& p) {
  const VkPhysicalDeviceLimits& limits = p.core.properties.limits;
  info.max_group_invocations = limits.maxComputeWorkGroupInvocations;
  info.max_group_size_x = limits.maxComputeWorkGroupSize[0];
  info.max_group_count_x = limits.maxComputeWorkGroupCount[0];
  info.max_storage_range = limits.maxStorageBufferRange;
  info.max_storage_buffers = limits.maxPerStageDescriptorStorageBuffers;
  info.max_texels = limits.maxTexelBufferElements;
  info.max_allocation = info.max_buffer = p.v11.maxMemoryAllocationSize;
  // What a driver surely allocates at once is not the most that it can: 4 GiB on GPUs that have 141 GB. GPUs' drivers
  // must fail in order beyond it; some software drivers crash.
  if (!info.is_cpu()) info.max_buffer = std::max<std::uint64_t>(info.max_buffer, p.buffers.maxBufferSize);
  info.host_page = p.host.minImportedHostPointerAlignment;
  info.buffer_alignment =
      std::max({limits.minTexelBufferOffsetAlignment, limits.minStorageBufferOffsetAlignment, VkDeviceSize(16)});
  info.shared_bytes = limits.maxComputeSharedMemorySize;
  info.timestamp_ns = limits.timestampComputeAndGraphics ? double(limits.timestampPeriod) : 0;
}

void read_subgroups(DeviceInfo& info, const DeviceProperties& p, const DeviceFeatures& f, bool size_control,
                    bool uniform_flow) {
  info.subgroup_size = info.min_subgroup_size = info.max_subgroup_size = p.v11.subgroupSize;
  info.size_control = size_control && f.size_control.subgroupSizeControl &&
                      (p.size_control.requiredSubgroupSizeStages & VK_SHADER_STAGE_COMPUTE_BIT) != 0;
  info.full_subgroups = size_control && f.size_control.computeFullSubgroups;
  info.max_group_subgroups = info.max_group_invocations / p.v11.subgroupSize;
  if (info.size_control) {
    info.min_subgroup_size = p.size_control.minSubgroupSize;
    info.max_subgroup_size = p.size_control.maxSubgroupSize;
    info.max_group_subgroups = p.size_control.maxComputeWorkgroupSubgroups;
  }
  info.uniform_flow = uniform_flow && f.uniform_flow.shaderSubgroupUniformControlFlow;
  info.shuffle = (p.v11.subgroupSupportedOperations & VK_SUBGROUP_FEATURE_SHUFFLE_BIT) != 0;
  info.arithmetic = (p.v11.subgroupSupportedOperations & VK_SUBGROUP_FEATURE_ARITHMETIC_BIT) != 0;
  info.buffer_address = f.v12.bufferDeviceAddress == VK_TRUE;
  info.float64 = f.core.features.shaderFloat64 == VK_TRUE;
}

/// Returns the features of an extension that a device has.
template <class Features>
Features features_of(const Vulkan& vk, VkPhysicalDevice device, VkStructureType type) {
  Features of_extension{};
  of_extension.sType = type;
  VkPhysicalDeviceFeatures2 features{};
  features.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FEATURES_2;
  features.pNext = &of_extension;
  vk.GetPhysicalDeviceFeatures2(device, &features);
  return of_extension;
}

bool reports_faults(const Vulkan& vk, VkPhysicalDevice device, const std::vector<VkExtensionProperties>& extensions) {
  constexpr VkStructureType kType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FAULT_FEATURES_EXT;
  return has_extension(extensions, VK_EXT_DEVICE_FAULT_EXTENSION_NAME) &&
         features_of<VkPhysicalDeviceFaultFeaturesEXT>(vk, device, kType).deviceFault;
}

bool keeps_indices_within(const Vulkan& vk, VkPhysicalDevice device,
                          const std::vector<VkExtensionProperties>& extensions) {
  constexpr VkStructureType kType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PIPELINE_ROBUSTNESS_FEATURES_EXT;
  return has_extension(extensions, VK_EXT_PIPELINE_ROBUSTNESS_EXTENSION_NAME) &&
         features_of<VkPhysicalDevicePipelineRobustnessFeaturesEXT>(vk, device, kType).pipelineRobustness;
}

DeviceInfo read_device(const Vulkan& vk, VkPhysicalDevice device) {
  const auto extensions = extensions_of(vk, device);
  const bool size_control = has_extension(extensions, VK_EXT_SUBGROUP_SIZE_CONTROL_EXTENSION_NAME);
  const bool uniform_flow = has_extension(extensions, VK_KHR_SHADER_SUBGROUP_UNIFORM_CONTROL_FLOW_EXTENSION_NAME);
  const bool executables = has_extension(extensions, VK_KHR_PIPELINE_EXECUTABLE_PROPERTIES_EXTENSION_NAME);
  DeviceProperties p;
  DeviceFeatures f;
  p.v11.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_1_PROPERTIES;
  p.v12.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_PROPERTIES;
  p.host.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_EXTERNAL_MEMORY_HOST_PROPERTIES_EXT;
  p.buffers.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_4_PROPERTIES_KHR;
  p.size_control.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SUBGROUP_SIZE_CONTROL_PROPERTIES_EXT;
  f.v12.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_FEATURES;
  f.size_control.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SUBGROUP_SIZE_CONTROL_FEATURES_EXT;
  f.uniform_flow.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_SHADER_SUBGROUP_UNIFORM_CONTROL_FLOW_FEATURES_KHR;
  f.executables.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PIPELINE_EXECUTABLE_PROPERTIES_FEATURES_KHR;
  DeviceInfo info;
  vk.GetPhysicalDeviceProperties2(device, &p.core);
  info.name = p.core.properties.deviceName;
  info.api_version = p.core.properties.apiVersion;
  info.type = p.core.properties.deviceType;
  info.vendor_id = p.core.properties.vendorID;
  info.device_id = p.core.properties.deviceID;
  info.driver_version = p.core.properties.driverVersion;
  std::memcpy(info.pipeline_cache_uuid, p.core.properties.pipelineCacheUUID, VK_UUID_SIZE);
  if (info.api_version < VK_API_VERSION_1_2) {
    info.refusals = refusals_of(p, f);
    return info;
  }
  p.core.pNext = &p.v11;
  p.v11.pNext = &p.v12;
  p.v12.pNext = size_control ? &p.size_control : nullptr;
  if (has_extension(extensions, VK_EXT_EXTERNAL_MEMORY_HOST_EXTENSION_NAME))
    p.host.pNext = std::exchange(p.v12.pNext, &p.host);
  if (has_extension(extensions, VK_KHR_MAINTENANCE_4_EXTENSION_NAME))
    p.buffers.pNext = std::exchange(p.v12.pNext, &p.buffers);
  vk.GetPhysicalDeviceProperties2(device, &p.core);
  f.core.pNext = &f.v12;
  void** tail = &f.v12.pNext;
  if (size_control) *tail = &f.size_control, tail = &f.size_control.pNext;
  if (uniform_flow) *tail = &f.uniform_flow, tail = &f.uniform_flow.pNext;
  if (executables) *tail = &f.executables;
  vk.GetPhysicalDeviceFeatures2(device, &f.core);
  info.pipeline_statistics = f.executables.pipelineExecutableInfo == VK_TRUE;
  info.driver = fmt::format("{} {}", p.v12.driverName, p.v12.driverInfo);
  info.driver_id = p.v12.driverID;
  read_limits(info, p);
  read_subgroups(info, p, f, size_control, uniform_flow);
  info.fault_reports = reports_faults(vk, device, extensions);
  info.pipeline_robustness = keeps_indices_within(vk, device, extensions);
  info.memory_fd = has_extension(extensions, VK_KHR_EXTERNAL_MEMORY_FD_EXTENSION_NAME);
  std::memcpy(info.uuid, p.v11.deviceUUID, VK_UUID_SIZE);
  info.refusals = refusals_of(p, f);
  const int family = compute_family(vk, device);
  if (family < 0) info.refusals.emplace_back("it has no queue family with compute");
  if (family >= 0) take_queue(vk, device, std::uint32_t(family), info);
  info.lacks = lacks_of(info);
  return info;
}

int rank(const DeviceInfo& d) {
  switch (d.type) {
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
      return 4;
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
      return 3;
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
      return 2;
    case VK_PHYSICAL_DEVICE_TYPE_CPU:
      return 1;
    default:
      return 0;
  }
}

std::string list_of(const std::vector<DeviceInfo>& devices) {
  std::string text;
  for (std::size_t i = 0; i < devices.size(); ++i) {
    text += fmt::format("{} {}: {} ({})", i ? ";" : "", i, devices[i].name, devices[i].driver);
    for (const std::string& r : devices[i].refusals) text += fmt::format(", refused: {}", r);
  }
  return text;
}

bool matches(const DeviceInfo& d, std::size_t index, std::string_view wanted) {
  std::size_t number = 0;
  const auto [end, error] = std::from_chars(wanted.data(), wanted.data() + wanted.size(), number);
  if (error == std::errc() && end == wanted.data() + wanted.size()) return number == index;
  if (wanted == "gpu") return rank(d) >= 2;
  if (wanted == "cpu") return d.is_cpu();
  return d.name.find(wanted) != std::string::npos;
}

}  // namespace

std::vector<std::string> refusals_of(const DeviceProperties& p, const DeviceFeatures& f) {
  const std::uint32_t version = p.core.properties.apiVersion;
  if (version < VK_API_VERSION_1_2)  // its other features cannot be queried
    return {fmt::format("it offers Vulkan {}.{}, Ballot needs 1.2", VK_API_VERSION_MAJOR(version),
                        VK_API_VERSION_MINOR(version))};
  std::vector<std::string> refusals;
  for (const Requirement& r : kRequirements)
    if (!r.met(p, f)) refusals.push_back(fmt::format("it lacks {} ({})", r.what, r.why));
  return refusals;
}

Driver DeviceInfo::known_driver() const {
  if (driver_id == VK_DRIVER_ID_MESA_LLVMPIPE) return Driver::Llvmpipe;
  return driver_id == VK_DRIVER_ID_NVIDIA_PROPRIETARY ? Driver::Nvidia : Driver::Other;
}

std::uint32_t DeviceInfo::mesa_version() const {
  const bool mesa = driver_id == VK_DRIVER_ID_MESA_LLVMPIPE || driver_id == VK_DRIVER_ID_MESA_RADV ||
                    driver_id == VK_DRIVER_ID_INTEL_OPEN_SOURCE_MESA || driver_id == VK_DRIVER_ID_MESA_TURNIP;
  if (!mesa) return 0;
  if (VK_API_VERSION_MAJOR(driver_version) > 1)
    return VK_API_VERSION_MAJOR(driver_version) * 10000 + VK_API_VERSION_MINOR(driver_version) * 100 +
           VK_API_VERSION_PATCH(driver_version);
  // lavapipe before 23.1 reports driverVersion 1; its name carries the version: "llvmpipe Mesa 22.3.6 (...)".
  const std::size_t at = driver.find("Mesa ");
  unsigned major = 0, minor = 0, patch = 0;
  if (at == std::string::npos || std::sscanf(driver.c_str() + at, "Mesa %u.%u.%u", &major, &minor, &patch) < 2)
    return 0;
  return major * 10000 + minor * 100 + patch;
}

std::vector<PhysicalDevice> physical_devices(const Vulkan& vk, VkInstance instance) {
  std::uint32_t count = 0;
  vk_check(vk.EnumeratePhysicalDevices(instance, &count, nullptr), "listing Vulkan devices");
  std::vector<VkPhysicalDevice> handles(count);
  vk_check(vk.EnumeratePhysicalDevices(instance, &count, handles.data()), "listing Vulkan devices");
  std::vector<PhysicalDevice> devices;
  for (VkPhysicalDevice handle : handles) devices.push_back({handle, read_device(vk, handle)});
  return devices;
}

void take_queue(const Vulkan& vk, VkPhysicalDevice device, std::uint32_t family, DeviceInfo& info) {
  const auto families = queue_families(vk, device);
  if (family >= families.size())
    fail(Failure::Arguments, "vulkan: queue_family is {}; {} has {} families", family, info.name, families.size());
  if (!(families[family].queueFlags & VK_QUEUE_COMPUTE_BIT))
    fail(Failure::Device, "vulkan: queue family {} of {} has no compute; give a queue of one that has", family,
         info.name);
  info.timestamp_bits = families[family].timestampValidBits;
  if (info.timestamp_bits == 0) info.timestamp_ns = 0;
}

int compute_family(const Vulkan& vk, VkPhysicalDevice device) {
  const auto families = queue_families(vk, device);
  const auto count = std::uint32_t(families.size());
  for (std::uint32_t i = 0; i < count; ++i)
    if (families[i].queueFlags & VK_QUEUE_COMPUTE_BIT) return int(i);
  return -1;
}

int present_family(const Vulkan& vk, VkPhysicalDevice device, VkSurfaceKHR surface) {
  if (!has_extension(extensions_of(vk, device), VK_KHR_SWAPCHAIN_EXTENSION_NAME)) return -1;
  const auto families = queue_families(vk, device);
  constexpr VkQueueFlags kBoth = VK_QUEUE_COMPUTE_BIT | VK_QUEUE_GRAPHICS_BIT;
  for (std::uint32_t i = 0; i < std::uint32_t(families.size()); ++i) {
    VkBool32 presents = VK_FALSE;
    if ((families[i].queueFlags & kBoth) != kBoth) continue;
    if (vk.GetPhysicalDeviceSurfaceSupportKHR(device, i, surface, &presents) == VK_SUCCESS && presents) return int(i);
  }
  return -1;
}

std::vector<const char*> optional_extensions(const Vulkan& vk, VkPhysicalDevice device) {
  const auto all = extensions_of(vk, device);
  std::vector<const char*> names;
  for (const char* name :
       {VK_EXT_SUBGROUP_SIZE_CONTROL_EXTENSION_NAME, VK_KHR_SHADER_SUBGROUP_UNIFORM_CONTROL_FLOW_EXTENSION_NAME,
        VK_KHR_EXTERNAL_MEMORY_FD_EXTENSION_NAME, VK_EXT_EXTERNAL_MEMORY_HOST_EXTENSION_NAME})
    if (has_extension(all, name)) names.push_back(name);
  return names;
}

void fail_without_driver() {
  const char* name = "VK_DRIVER_FILES";
  const char* files = std::getenv(name);
  if (!files) files = std::getenv(name = "VK_ICD_FILENAMES");
  fail(Failure::Device, "no Vulkan device: the loader found no driver{}; install one, {}",
       files ? fmt::format(", as {} is {}", name, files) : "", kDriverInstall);
}

std::size_t choose_device(const std::vector<DeviceInfo>& devices, std::string_view wanted) {
  if (devices.empty()) fail_without_driver();
  bool named = false;
  std::size_t best = devices.size();
  for (std::size_t i = 0; i < devices.size(); ++i) {
    if (!wanted.empty() && !matches(devices[i], i, wanted)) continue;
    named = true;
    if (!devices[i].refusals.empty()) continue;
    if (best == devices.size() || rank(devices[i]) > rank(devices[best])) best = i;
  }
  if (!named)
    fail(Failure::Arguments,
         "device: no device is called '{}'; give an index, part of a name, 'gpu' or 'cpu'; there are:{}", wanted,
         list_of(devices));
  if (best == devices.size())
    fail(Failure::Device, "no usable Vulkan device; every candidate was refused:{}; install a newer driver, {}",
         list_of(devices), kDriverInstall);
  return best;
}

}  // namespace ballot
