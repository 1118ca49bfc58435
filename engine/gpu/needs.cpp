// What Ballot needs of a device beyond Vulkan 1.2, and what it uses where it is there.
#include <algorithm>

#include "engine/core/error.h"
#include "engine/gpu/device.h"

namespace ballot {

namespace {

constexpr const char *kCore = "VkPhysicalDeviceFeatures", *kV12 = "VkPhysicalDeviceVulkan12Features";

/// A need, and how a device tells of it.
struct Row {
  VulkanNeed need;
  const char* what;  // in words; "" if nobody misses it
  bool (*has)(const DeviceInfo&);
  void (*take)(DeviceInfo&);  // has the device go without it
};

constexpr Row kRows[] = {
    {{"scalarBlockLayout", kV12, true, "records are packed without padding"},
     "",
     [](const DeviceInfo&) { return true; },  // devices without it are refused
     [](DeviceInfo&) {}},
    {{"subgroupSizeControl", VK_EXT_SUBGROUP_SIZE_CONTROL_EXTENSION_NAME, false,
      "the driver's subgroup size is taken as it is"},
     "subgroup size control",
     [](const DeviceInfo& d) { return d.size_control; },
     [](DeviceInfo& d) {
       d.size_control = false;
       d.min_subgroup_size = d.max_subgroup_size = d.subgroup_size;
       d.max_group_subgroups = d.max_group_invocations / d.subgroup_size;
     }},
    {{"computeFullSubgroups", VK_EXT_SUBGROUP_SIZE_CONTROL_EXTENSION_NAME, false,
      "workgroups are a multiple of the subgroup, and the driver is trusted to fill them"},
     "full subgroups",
     [](const DeviceInfo& d) { return d.full_subgroups; },
     [](DeviceInfo& d) { d.full_subgroups = false; }},
    {{"shaderSubgroupUniformControlFlow", VK_KHR_SHADER_SUBGROUP_UNIFORM_CONTROL_FLOW_EXTENSION_NAME, false,
      "votes rely on the driver reconverging a uniform loop"},
     "subgroup uniform control flow",
     [](const DeviceInfo& d) { return d.uniform_flow; },
     [](DeviceInfo& d) { d.uniform_flow = false; }},
    {{"bufferDeviceAddress", kV12, false, "nodes are read through storage or texel buffers"},
     "buffer device address",
     [](const DeviceInfo& d) { return d.buffer_address; },
     [](DeviceInfo& d) { d.buffer_address = false; }},
    {{"shaderFloat64", kCore, false, "numeric mode exact does not run"},
     "float64",
     [](const DeviceInfo& d) { return d.float64; },
     [](DeviceInfo& d) { d.float64 = false; }},
    {{"pipelineRobustness", VK_EXT_PIPELINE_ROBUSTNESS_EXTENSION_NAME, false,
      "kernels of users may read and write outside of their arrays"},
     "pipeline robustness",
     [](const DeviceInfo& d) { return d.pipeline_robustness; },
     [](DeviceInfo& d) { d.pipeline_robustness = false; }},
    {{"deviceFault", VK_EXT_DEVICE_FAULT_EXTENSION_NAME, false, "a lost device does not tell why"},
     "",
     [](const DeviceInfo& d) { return d.fault_reports; },
     [](DeviceInfo& d) { d.fault_reports = false; }},
    {{VK_KHR_EXTERNAL_MEMORY_FD_EXTENSION_NAME, "", false, "arrays are not shared with other interfaces"},
     "",
     [](const DeviceInfo& d) { return d.memory_fd; },
     [](DeviceInfo& d) { d.memory_fd = false; }},
    {{VK_EXT_EXTERNAL_MEMORY_HOST_EXTENSION_NAME, "", false, "the caller's memory is copied"},
     "",
     [](const DeviceInfo& d) { return d.host_page != 0; },
     [](DeviceInfo& d) { d.host_page = 0; }},
};

/// Returns true if the device does so without the feature.
bool does_without(const DeviceInfo& device, const Row& row) {
  return row.need.name == std::string_view("pipelineRobustness") && device.robust_buffers();
}

}  // namespace

std::span<const VulkanNeed> vulkan_needs() {
  static const std::vector<VulkanNeed> needs = [] {
    std::vector<VulkanNeed> all;
    for (const Row& row : kRows) all.push_back(row.need);
    return all;
  }();
  return needs;
}

std::vector<std::string> lacks_of(const DeviceInfo& device) {
  std::vector<std::string> lacks;
  for (const Row& row : kRows)
    if (*row.what && !row.has(device) && !does_without(device, row))
      lacks.push_back(fmt::format("{}: {}", row.what, row.need.why));
  if (!device.shuffle)
    lacks.emplace_back("subgroup shuffle: packets keep their stack in shared memory and every lane loads each node");
  if (device.timestamp_ns == 0) lacks.emplace_back("timestamps: times are wall times of the host");
  return lacks;
}

void take_what_is_off(const std::vector<std::string>& enabled, DeviceInfo& device) {
  for (const std::string& name : enabled) {
    const auto* row = std::ranges::find(kRows, name, [](const Row& r) { return std::string_view(r.need.name); });
    if (row == std::end(kRows)) {
      std::string known;
      for (const Row& r : kRows) known += fmt::format("{}{}", known.empty() ? "" : ", ", r.need.name);
      fail(Failure::Arguments, "vulkan: enabled has '{}'; expected names of {}", name, known);
    }
    if (!row->has(device))
      fail(Failure::Arguments, "vulkan: enabled has {}, which {} ({}) does not have", name, device.name, device.driver);
  }
  for (const Row& row : kRows) {
    if (std::ranges::find(enabled, row.need.name) != enabled.end()) continue;
    if (row.need.required && !enabled.empty())
      fail(Failure::Device, "vulkan: enabled has no {}, which Ballot needs: {}", row.need.name, row.need.why);
    row.take(device);
  }
}

}  // namespace ballot
