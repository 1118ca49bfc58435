// A Vulkan layer that makes calls fail, for tests. The environment variable BALLOT_FAULT says which:
//   allocate:N   the N-th call that makes an object, allocates or records is out of memory
//   submit:N     the device is lost at the N-th submission, and from then on
//   wait:N       the device is lost at the N-th wait for a fence, and from then on
//   timeout:N    the N-th wait for a fence ends too early, once
//   outdated:N   the N-th call that takes or presents an image of a window says that the window has changed, once
//   none         nothing fails
// At the end of the device and of the instance a line of BALLOT_FAULT_LOG tells how many calls there were of each kind,
// and which objects are left. With BALLOT_FAULT_DESCRIBE the device offers VK_EXT_device_fault and describes its loss.
#include <vulkan/vk_layer.h>
#include <vulkan/vulkan.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "tests/faults/fault_state.h"

namespace {

using fault::count;
using fault::fails;
using fault::is_lost;
using fault::lose;

bool describes() { return std::getenv("BALLOT_FAULT_DESCRIBE") != nullptr; }

PFN_vkGetInstanceProcAddr next_instance_proc = nullptr;
PFN_vkGetDeviceProcAddr next_device_proc = nullptr;
VkInstance last_instance = VK_NULL_HANDLE;
VkDevice last_device = VK_NULL_HANDLE;

template <class Function>
Function next_of(const char* name) {
  return reinterpret_cast<Function>(next_device_proc(last_device, name));
}

/// Functions below this layer. They are asked for while an instance is made: later the loader answers with the top of
/// the chain. They are the same for all instances.
struct Below {
  PFN_vkDestroyInstance destroy_instance;
  PFN_vkEnumeratePhysicalDevices list_devices;
  PFN_vkEnumerateDeviceExtensionProperties list_extensions;
  PFN_vkGetPhysicalDeviceFeatures2 get_features;
  PFN_vkCreateDevice create_device;
};
Below below{};

template <class Function>
void find_below(Function& function, const char* name) {
  function = reinterpret_cast<Function>(next_instance_proc(last_instance, name));
}

void find_all_below() {
  find_below(below.destroy_instance, "vkDestroyInstance");
  find_below(below.list_devices, "vkEnumeratePhysicalDevices");
  find_below(below.list_extensions, "vkEnumerateDeviceExtensionProperties");
  find_below(below.get_features, "vkGetPhysicalDeviceFeatures2");
  find_below(below.create_device, "vkCreateDevice");
}

// Functions that make or destroy an object of a device.
// clang-format off
#define OBJECTS(X) \
  X(Buffer) X(BufferView) X(ShaderModule) X(PipelineLayout) X(DescriptorSetLayout) \
  X(DescriptorPool) X(CommandPool) X(Fence) X(QueryPool) X(Image) X(ImageView) X(Sampler) X(RenderPass) \
  X(Framebuffer) X(Semaphore)
// clang-format on

#define WRAP(object)                                                                                                \
  VKAPI_ATTR VkResult VKAPI_CALL create_##object(VkDevice device, const Vk##object##CreateInfo* info,               \
                                                 const VkAllocationCallbacks* allocator, Vk##object* made) {        \
    if (fails("allocate")) return VK_ERROR_OUT_OF_HOST_MEMORY;                                                      \
    const VkResult result = next_of<PFN_vkCreate##object>("vkCreate" #object)(device, info, allocator, made);       \
    if (result == VK_SUCCESS) count(#object, 1);                                                                    \
    return result;                                                                                                  \
  }                                                                                                                 \
  VKAPI_ATTR void VKAPI_CALL destroy_##object(VkDevice device, Vk##object object, const VkAllocationCallbacks* a) { \
    if (object) count(#object, -1);                                                                                 \
    next_of<PFN_vkDestroy##object>("vkDestroy" #object)(device, object, a);                                         \
  }
OBJECTS(WRAP)
#undef WRAP

VKAPI_ATTR VkResult VKAPI_CALL create_cache(VkDevice device, const VkPipelineCacheCreateInfo* info,
                                            const VkAllocationCallbacks* allocator, VkPipelineCache* made) {
  if (fails("allocate")) return VK_ERROR_OUT_OF_HOST_MEMORY;
  fault::note_cache(info->initialDataSize);
  const VkResult result = next_of<PFN_vkCreatePipelineCache>("vkCreatePipelineCache")(device, info, allocator, made);
  if (result == VK_SUCCESS) count("PipelineCache", 1);
  return result;
}

VKAPI_ATTR void VKAPI_CALL destroy_cache(VkDevice device, VkPipelineCache cache, const VkAllocationCallbacks* a) {
  if (cache) count("PipelineCache", -1);
  next_of<PFN_vkDestroyPipelineCache>("vkDestroyPipelineCache")(device, cache, a);
}

VKAPI_ATTR VkResult VKAPI_CALL create_swapchain(VkDevice device, const VkSwapchainCreateInfoKHR* info,
                                                const VkAllocationCallbacks* allocator, VkSwapchainKHR* made) {
  if (fails("allocate")) return VK_ERROR_OUT_OF_DEVICE_MEMORY;
  const auto result = next_of<PFN_vkCreateSwapchainKHR>("vkCreateSwapchainKHR")(device, info, allocator, made);
  if (result == VK_SUCCESS) count("Swapchain", 1);
  return result;
}

VKAPI_ATTR void VKAPI_CALL destroy_swapchain(VkDevice device, VkSwapchainKHR object, const VkAllocationCallbacks* a) {
  if (object) count("Swapchain", -1);
  next_of<PFN_vkDestroySwapchainKHR>("vkDestroySwapchainKHR")(device, object, a);
}

VKAPI_ATTR VkResult VKAPI_CALL allocate_memory(VkDevice device, const VkMemoryAllocateInfo* info,
                                               const VkAllocationCallbacks* allocator, VkDeviceMemory* made) {
  if (fails("allocate")) return VK_ERROR_OUT_OF_DEVICE_MEMORY;
  const VkResult result = next_of<PFN_vkAllocateMemory>("vkAllocateMemory")(device, info, allocator, made);
  if (result == VK_SUCCESS) count("Memory", 1);
  return result;
}

VKAPI_ATTR void VKAPI_CALL free_memory(VkDevice device, VkDeviceMemory memory, const VkAllocationCallbacks* a) {
  if (memory) count("Memory", -1);
  next_of<PFN_vkFreeMemory>("vkFreeMemory")(device, memory, a);
}

template <class Info, class Next>
VkResult create_pipelines(const char* name, VkDevice device, VkPipelineCache cache, std::uint32_t number,
                          const Info* info, const VkAllocationCallbacks* allocator, VkPipeline* made) {
  if (fails("allocate")) {
    std::fill_n(made, number, VkPipeline{});
    return VK_ERROR_OUT_OF_HOST_MEMORY;
  }
  const VkResult result = next_of<Next>(name)(device, cache, number, info, allocator, made);
  if (result == VK_SUCCESS) count("Pipeline", number);
  return result;
}

VKAPI_ATTR VkResult VKAPI_CALL create_compute(VkDevice device, VkPipelineCache cache, std::uint32_t number,
                                              const VkComputePipelineCreateInfo* info, const VkAllocationCallbacks* a,
                                              VkPipeline* made) {
  return create_pipelines<VkComputePipelineCreateInfo, PFN_vkCreateComputePipelines>("vkCreateComputePipelines", device,
                                                                                     cache, number, info, a, made);
}

VKAPI_ATTR VkResult VKAPI_CALL create_graphics(VkDevice device, VkPipelineCache cache, std::uint32_t number,
                                               const VkGraphicsPipelineCreateInfo* info, const VkAllocationCallbacks* a,
                                               VkPipeline* made) {
  return create_pipelines<VkGraphicsPipelineCreateInfo, PFN_vkCreateGraphicsPipelines>(
      "vkCreateGraphicsPipelines", device, cache, number, info, a, made);
}

VKAPI_ATTR void VKAPI_CALL destroy_pipeline(VkDevice device, VkPipeline pipeline, const VkAllocationCallbacks* a) {
  if (pipeline) count("Pipeline", -1);
  next_of<PFN_vkDestroyPipeline>("vkDestroyPipeline")(device, pipeline, a);
}

// Other calls that may run out of memory: name, arguments in parentheses, names of the arguments in parentheses.
// clang-format off
#define OTHERS(X) \
  X(MapMemory, (VkDevice a, VkDeviceMemory b, VkDeviceSize c, VkDeviceSize d, VkMemoryMapFlags e, void** f), \
    (a, b, c, d, e, f)) \
  X(BindBufferMemory, (VkDevice a, VkBuffer b, VkDeviceMemory c, VkDeviceSize d), (a, b, c, d)) \
  X(BindImageMemory, (VkDevice a, VkImage b, VkDeviceMemory c, VkDeviceSize d), (a, b, c, d)) \
  X(AllocateDescriptorSets, (VkDevice a, const VkDescriptorSetAllocateInfo* b, VkDescriptorSet* c), (a, b, c)) \
  X(AllocateCommandBuffers, (VkDevice a, const VkCommandBufferAllocateInfo* b, VkCommandBuffer* c), (a, b, c)) \
  X(ResetCommandPool, (VkDevice a, VkCommandPool b, VkCommandPoolResetFlags c), (a, b, c)) \
  X(ResetCommandBuffer, (VkCommandBuffer a, VkCommandBufferResetFlags b), (a, b)) \
  X(BeginCommandBuffer, (VkCommandBuffer a, const VkCommandBufferBeginInfo* b), (a, b)) \
  X(EndCommandBuffer, (VkCommandBuffer a), (a)) \
  X(ResetFences, (VkDevice a, std::uint32_t b, const VkFence* c), (a, b, c)) \
  X(GetPipelineCacheData, (VkDevice a, VkPipelineCache b, std::size_t* c, void* d), (a, b, c, d)) \
  X(GetSwapchainImagesKHR, (VkDevice a, VkSwapchainKHR b, std::uint32_t* c, VkImage* d), (a, b, c, d))
// Calls that a lost device refuses.
#define WAITERS(X) \
  X(GetFenceStatus, (VkDevice a, VkFence b), (a, b)) \
  X(QueueWaitIdle, (VkQueue a), (a)) \
  X(DeviceWaitIdle, (VkDevice a), (a)) \
  X(GetQueryPoolResults, (VkDevice a, VkQueryPool b, std::uint32_t c, std::uint32_t d, std::size_t e, void* f, \
    VkDeviceSize g, VkQueryResultFlags h), (a, b, c, d, e, f, g, h))
// clang-format on

#define WRAP(name, parameters, arguments)                      \
  VKAPI_ATTR VkResult VKAPI_CALL other_##name parameters {     \
    if (fails("allocate")) return VK_ERROR_OUT_OF_HOST_MEMORY; \
    return next_of<PFN_vk##name>("vk" #name) arguments;        \
  }
OTHERS(WRAP)
#undef WRAP

#define WRAP(name, parameters, arguments)                   \
  VKAPI_ATTR VkResult VKAPI_CALL waiter_##name parameters { \
    if (is_lost()) return VK_ERROR_DEVICE_LOST;             \
    return next_of<PFN_vk##name>("vk" #name) arguments;     \
  }
WAITERS(WRAP)
#undef WRAP

VKAPI_ATTR VkResult VKAPI_CALL queue_submit(VkQueue queue, std::uint32_t number, const VkSubmitInfo* infos,
                                            VkFence fence) {
  if (fails("allocate")) return VK_ERROR_OUT_OF_DEVICE_MEMORY;
  if (fails("submit")) lose();
  if (is_lost()) return VK_ERROR_DEVICE_LOST;
  return next_of<PFN_vkQueueSubmit>("vkQueueSubmit")(queue, number, infos, fence);
}

VKAPI_ATTR VkResult VKAPI_CALL wait_for_fences(VkDevice device, std::uint32_t number, const VkFence* fences,
                                               VkBool32 all, std::uint64_t timeout) {
  const bool early = fails("timeout");
  const auto wait = next_of<PFN_vkWaitForFences>("vkWaitForFences");
  if (fails("wait")) lose();
  if (is_lost()) {  // the device below is well: it must be idle before its objects are destroyed
    wait(device, number, fences, all, timeout);
    return VK_ERROR_DEVICE_LOST;
  }
  return early ? VK_TIMEOUT : wait(device, number, fences, all, timeout);
}

VKAPI_ATTR VkResult VKAPI_CALL acquire_image(VkDevice device, VkSwapchainKHR swapchain, std::uint64_t timeout,
                                             VkSemaphore semaphore, VkFence fence, std::uint32_t* index) {
  if (is_lost()) return VK_ERROR_DEVICE_LOST;
  if (fails("outdated")) return VK_ERROR_OUT_OF_DATE_KHR;
  return next_of<PFN_vkAcquireNextImageKHR>("vkAcquireNextImageKHR")(device, swapchain, timeout, semaphore, fence,
                                                                     index);
}

VKAPI_ATTR VkResult VKAPI_CALL present(VkQueue queue, const VkPresentInfoKHR* info) {
  if (is_lost()) return VK_ERROR_DEVICE_LOST;
  const bool outdated = fails("outdated");
  const VkResult result = next_of<PFN_vkQueuePresentKHR>("vkQueuePresentKHR")(queue, info);
  return outdated ? VK_ERROR_OUT_OF_DATE_KHR : result;
}

VKAPI_ATTR VkResult VKAPI_CALL fault_info(VkDevice, VkDeviceFaultCountsEXT* counts, VkDeviceFaultInfoEXT* info) {
  counts->addressInfoCount = counts->vendorInfoCount = 1;
  counts->vendorBinarySize = 0;
  if (!info) return VK_SUCCESS;
  std::strcpy(info->description, "a fault of the tests");
  info->pAddressInfos[0] = {VK_DEVICE_FAULT_ADDRESS_TYPE_READ_INVALID_EXT, 0x1000, 16};
  std::strcpy(info->pVendorInfos[0].description, "unit 7");
  info->pVendorInfos[0].vendorFaultCode = 5;
  info->pVendorInfos[0].vendorFaultData = 6;
  return VK_SUCCESS;
}

/// Removes the structure of a type from a chain that the caller keeps.
void unchain(const void* begin, VkStructureType type) {
  auto* at = static_cast<VkBaseOutStructure*>(const_cast<void*>(begin));
  for (; at->pNext; at = at->pNext)
    if (at->pNext->sType == type) {
      at->pNext = at->pNext->pNext;
      return;
    }
}

/// Returns this layer's entry in the chain of a create call.
template <class Entry>
Entry* link_of(const void* begin, VkStructureType type) {
  for (auto* at = static_cast<const VkBaseInStructure*>(begin); at; at = at->pNext) {
    auto* entry = reinterpret_cast<Entry*>(const_cast<VkBaseInStructure*>(at));
    if (at->sType == type && entry->function == VK_LAYER_LINK_INFO) return entry;
  }
  return nullptr;
}

VKAPI_ATTR VkResult VKAPI_CALL create_instance(const VkInstanceCreateInfo* info, const VkAllocationCallbacks* a,
                                               VkInstance* instance) {
  auto* link = link_of<VkLayerInstanceCreateInfo>(info->pNext, VK_STRUCTURE_TYPE_LOADER_INSTANCE_CREATE_INFO);
  if (!link) return VK_ERROR_INITIALIZATION_FAILED;
  if (fails("allocate")) return VK_ERROR_OUT_OF_HOST_MEMORY;
  next_instance_proc = link->u.pLayerInfo->pfnNextGetInstanceProcAddr;
  link->u.pLayerInfo = link->u.pLayerInfo->pNext;
  const VkResult result =
      reinterpret_cast<PFN_vkCreateInstance>(next_instance_proc(VK_NULL_HANDLE, "vkCreateInstance"))(info, a, instance);
  if (result == VK_SUCCESS) {
    last_instance = *instance;
    find_all_below();
  }
  return result;
}

VKAPI_ATTR void VKAPI_CALL destroy_instance(VkInstance instance, const VkAllocationCallbacks* a) {
  fault::write_log();
  below.destroy_instance(instance, a);
}

VKAPI_ATTR VkResult VKAPI_CALL list_devices(VkInstance instance, std::uint32_t* number, VkPhysicalDevice* devices) {
  if (fails("allocate")) return VK_ERROR_OUT_OF_HOST_MEMORY;
  return below.list_devices(instance, number, devices);
}

VKAPI_ATTR VkResult VKAPI_CALL list_extensions(VkPhysicalDevice device, const char* layer, std::uint32_t* number,
                                               VkExtensionProperties* properties) {
  if (!describes() || layer) return below.list_extensions(device, layer, number, properties);
  std::uint32_t there = 0;
  below.list_extensions(device, nullptr, &there, nullptr);
  std::vector<VkExtensionProperties> all(there);
  below.list_extensions(device, nullptr, &there, all.data());
  VkExtensionProperties& own = all.emplace_back();
  std::strcpy(own.extensionName, VK_EXT_DEVICE_FAULT_EXTENSION_NAME);
  own.specVersion = VK_EXT_DEVICE_FAULT_SPEC_VERSION;
  if (properties) std::copy_n(all.begin(), std::min<std::size_t>(*number, all.size()), properties);
  const bool fits = !properties || *number >= all.size();
  *number = fits ? std::uint32_t(all.size()) : *number;
  return fits ? VK_SUCCESS : VK_INCOMPLETE;
}

VKAPI_ATTR void VKAPI_CALL get_features(VkPhysicalDevice device, VkPhysicalDeviceFeatures2* features) {
  below.get_features(device, features);
  for (auto* at = static_cast<VkBaseOutStructure*>(features->pNext); describes() && at; at = at->pNext)
    if (at->sType == VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FAULT_FEATURES_EXT)
      reinterpret_cast<VkPhysicalDeviceFaultFeaturesEXT*>(at)->deviceFault = VK_TRUE;
}

VKAPI_ATTR VkResult VKAPI_CALL create_device(VkPhysicalDevice physical, const VkDeviceCreateInfo* info,
                                             const VkAllocationCallbacks* a, VkDevice* device) {
  auto* link = link_of<VkLayerDeviceCreateInfo>(info->pNext, VK_STRUCTURE_TYPE_LOADER_DEVICE_CREATE_INFO);
  if (!link) return VK_ERROR_INITIALIZATION_FAILED;
  if (fails("allocate")) return VK_ERROR_OUT_OF_DEVICE_MEMORY;
  next_device_proc = link->u.pLayerInfo->pfnNextGetDeviceProcAddr;
  link->u.pLayerInfo = link->u.pLayerInfo->pNext;
  VkDeviceCreateInfo passed = *info;
  std::vector<const char*> names(info->ppEnabledExtensionNames,
                                 info->ppEnabledExtensionNames + info->enabledExtensionCount);
  if (describes()) {
    std::erase_if(names, [](const char* name) { return !std::strcmp(name, VK_EXT_DEVICE_FAULT_EXTENSION_NAME); });
    unchain(&passed, VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_FAULT_FEATURES_EXT);
  }
  passed.enabledExtensionCount = std::uint32_t(names.size());
  passed.ppEnabledExtensionNames = names.data();
  const VkResult result = below.create_device(physical, &passed, a, device);
  if (result == VK_SUCCESS) last_device = *device;
  return result;
}

VKAPI_ATTR void VKAPI_CALL destroy_device(VkDevice device, const VkAllocationCallbacks* a) {
  fault::write_log();
  next_of<PFN_vkDestroyDevice>("vkDestroyDevice")(device, a);
}

struct Named {
  const char* name;
  PFN_vkVoidFunction function;
};

/// Returns this layer's function of a name; null if the layer leaves it alone.
PFN_vkVoidFunction own_function(const char* name) {
#define ROW(name, function) {"vk" name, reinterpret_cast<PFN_vkVoidFunction>(function)},
#define OBJECT_ROWS(object) ROW("Create" #object, create_##object) ROW("Destroy" #object, destroy_##object)
#define OTHER_ROW(name, parameters, arguments) ROW(#name, other_##name)
#define WAITER_ROW(name, parameters, arguments) ROW(#name, waiter_##name)
  static const Named kFunctions[] = {
      OBJECTS(OBJECT_ROWS) OTHERS(OTHER_ROW) WAITERS(WAITER_ROW)                                     //
      ROW("CreatePipelineCache", create_cache) ROW("DestroyPipelineCache", destroy_cache)            //
      ROW("CreateSwapchainKHR", create_swapchain) ROW("DestroySwapchainKHR", destroy_swapchain)      //
      ROW("AllocateMemory", allocate_memory) ROW("FreeMemory", free_memory)                          //
      ROW("CreateComputePipelines", create_compute) ROW("CreateGraphicsPipelines", create_graphics)  //
      ROW("DestroyPipeline", destroy_pipeline) ROW("QueueSubmit", queue_submit)                      //
      ROW("WaitForFences", wait_for_fences) ROW("AcquireNextImageKHR", acquire_image)                //
      ROW("QueuePresentKHR", present) ROW("CreateInstance", create_instance)                         //
      ROW("DestroyInstance", destroy_instance) ROW("EnumeratePhysicalDevices", list_devices)         //
      ROW("EnumerateDeviceExtensionProperties", list_extensions) ROW("CreateDevice", create_device)
          ROW("GetPhysicalDeviceFeatures2", get_features)  //
      ROW("DestroyDevice", destroy_device)};
  for (const Named& row : kFunctions)
    if (!std::strcmp(row.name, name)) return row.function;
  if (describes() && !std::strcmp(name, "vkGetDeviceFaultInfoEXT"))
    return reinterpret_cast<PFN_vkVoidFunction>(fault_info);
  return nullptr;
}

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL device_proc(VkDevice device, const char* name) {
  if (!std::strcmp(name, "vkGetDeviceProcAddr")) return reinterpret_cast<PFN_vkVoidFunction>(device_proc);
  const PFN_vkVoidFunction own = own_function(name), next = next_device_proc(device, name);
  return own && (next || !std::strcmp(name, "vkGetDeviceFaultInfoEXT")) ? own : next;
}

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL instance_proc(VkInstance instance, const char* name) {
  if (!std::strcmp(name, "vkGetInstanceProcAddr")) return reinterpret_cast<PFN_vkVoidFunction>(instance_proc);
  if (!std::strcmp(name, "vkGetDeviceProcAddr")) return reinterpret_cast<PFN_vkVoidFunction>(device_proc);
  if (const PFN_vkVoidFunction own = own_function(name)) return own;
  return next_instance_proc ? next_instance_proc(instance, name) : nullptr;
}

}  // namespace

extern "C" VKAPI_ATTR VkResult VKAPI_CALL vkNegotiateLoaderLayerInterfaceVersion(VkNegotiateLayerInterface* version) {
  version->loaderLayerInterfaceVersion = std::min(version->loaderLayerInterfaceVersion, 2u);
  version->pfnGetInstanceProcAddr = instance_proc;
  version->pfnGetDeviceProcAddr = device_proc;
  version->pfnGetPhysicalDeviceProcAddr = nullptr;
  return VK_SUCCESS;
}
