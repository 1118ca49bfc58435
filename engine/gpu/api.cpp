#include "engine/gpu/api.h"

#include <dlfcn.h>

#include <cstdlib>

#include "engine/core/cache_file.h"

#ifdef __SANITIZE_ADDRESS__
// Keeps libraries loaded: leak reports can name a driver's module (tests/lsan.supp) only while it is loaded.
extern "C" int dlclose(void*) { return 0; }
#endif

namespace ballot {

namespace {

VulkanLoader open_loader() {
  prepare_driver_cache();
  const char* given = std::getenv("BALLOT_VULKAN_LOADER");
  void* library = dlopen(given ? given : "libvulkan.so.1", RTLD_NOW | RTLD_LOCAL);
  if (!library)
    fail(Failure::Device, "no Vulkan loader: {} was not found; install it with a driver, {}",
         given ? given : "libvulkan.so.1", kDriverInstall);
  VulkanLoader loader;
  loader.GetInstanceProcAddr = reinterpret_cast<PFN_vkGetInstanceProcAddr>(dlsym(library, "vkGetInstanceProcAddr"));
  if (!loader.GetInstanceProcAddr)
    fail(Failure::Device, "libvulkan.so.1 has no vkGetInstanceProcAddr; reinstall the Vulkan loader");
#define BALLOT_VK_LOAD(f) loader.f = reinterpret_cast<PFN_vk##f>(loader.GetInstanceProcAddr(nullptr, "vk" #f));
  BALLOT_VK_LOADER(BALLOT_VK_LOAD)
#undef BALLOT_VK_LOAD
  if (!loader.EnumerateInstanceVersion)
    fail(Failure::Device, "the Vulkan loader is older than Vulkan 1.1; Ballot needs Vulkan 1.2");
  return loader;
}

}  // namespace

const VulkanLoader& vulkan_loader() {
  static const VulkanLoader loader = open_loader();
  return loader;
}

void Vulkan::load_instance(VkInstance instance, PFN_vkGetInstanceProcAddr find, bool debug, bool surface) {
#define BALLOT_VK_LOAD(f) f = reinterpret_cast<PFN_vk##f>(find(instance, "vk" #f));
  BALLOT_VK_INSTANCE(BALLOT_VK_LOAD)
  if (surface) {
    BALLOT_VK_SURFACE(BALLOT_VK_LOAD)
  }
  if (debug) {
    BALLOT_VK_DEBUG(BALLOT_VK_LOAD)
  }
#undef BALLOT_VK_LOAD
}

void Vulkan::load_device(VkDevice device) {
#define BALLOT_VK_LOAD(f) f = reinterpret_cast<PFN_vk##f>(GetDeviceProcAddr(device, "vk" #f));
  BALLOT_VK_DEVICE(BALLOT_VK_LOAD)
  BALLOT_VK_DRAWING(BALLOT_VK_LOAD)
  BALLOT_VK_SWAPCHAIN(BALLOT_VK_LOAD)
  BALLOT_VK_STATISTICS(BALLOT_VK_LOAD)
  BALLOT_VK_EXTERNAL(BALLOT_VK_LOAD)
#undef BALLOT_VK_LOAD
}

const char* result_name(VkResult result) {
  switch (result) {
#define BALLOT_NAME(r) \
  case r:              \
    return #r;
    BALLOT_NAME(VK_SUCCESS)
    BALLOT_NAME(VK_NOT_READY)
    BALLOT_NAME(VK_TIMEOUT)
    BALLOT_NAME(VK_INCOMPLETE)
    BALLOT_NAME(VK_ERROR_OUT_OF_HOST_MEMORY)
    BALLOT_NAME(VK_ERROR_OUT_OF_DEVICE_MEMORY)
    BALLOT_NAME(VK_ERROR_INITIALIZATION_FAILED)
    BALLOT_NAME(VK_ERROR_DEVICE_LOST)
    BALLOT_NAME(VK_ERROR_MEMORY_MAP_FAILED)
    BALLOT_NAME(VK_ERROR_LAYER_NOT_PRESENT)
    BALLOT_NAME(VK_ERROR_EXTENSION_NOT_PRESENT)
    BALLOT_NAME(VK_ERROR_FEATURE_NOT_PRESENT)
    BALLOT_NAME(VK_ERROR_INCOMPATIBLE_DRIVER)
    BALLOT_NAME(VK_ERROR_TOO_MANY_OBJECTS)
    BALLOT_NAME(VK_ERROR_INVALID_SHADER_NV)
    BALLOT_NAME(VK_ERROR_FORMAT_NOT_SUPPORTED)
    BALLOT_NAME(VK_ERROR_SURFACE_LOST_KHR)
    BALLOT_NAME(VK_ERROR_NATIVE_WINDOW_IN_USE_KHR)
    BALLOT_NAME(VK_ERROR_OUT_OF_DATE_KHR)
    BALLOT_NAME(VK_SUBOPTIMAL_KHR)
#undef BALLOT_NAME
    default:
      return "an unknown VkResult";
  }
}

void vk_check(VkResult result, const char* what, const char* object) {
  if (result == VK_SUCCESS) return;
  const char* hint = "";
  if (result == VK_ERROR_OUT_OF_DEVICE_MEMORY) hint = "; the device has too little free memory for it";
  if (result == VK_ERROR_DEVICE_LOST)
    throw DeviceLost(fmt::format("{}{}{}: VK_ERROR_DEVICE_LOST; the driver gave the device up (see the system log)",
                                 what, *object ? " " : "", object));
  fail(Failure::Work, "{}{}{}: {}{}", what, *object ? " " : "", object, result_name(result), hint);
}

}  // namespace ballot
