#include "engine/vk/api.h"

#include <dlfcn.h>

#include <cstdlib>

#include "engine/core/error.h"
#include "engine/core/file.h"

#ifdef __SANITIZE_ADDRESS__
// Leak reports name a driver's module (tests/lsan.supp) only while it is loaded.
extern "C" int dlclose(void*) { return 0; }
#endif

namespace ballot {

#define BALLOT_VK_DEFINE(f) PFN_##f f = nullptr;
BALLOT_VK_GLOBAL(BALLOT_VK_DEFINE)
BALLOT_VK_INSTANCE(BALLOT_VK_DEFINE)
BALLOT_VK_DRAWING(BALLOT_VK_DEFINE)
BALLOT_VK_SURFACE(BALLOT_VK_DEFINE)
BALLOT_VK_DEBUG(BALLOT_VK_DEFINE)
BALLOT_VK_STATISTICS(BALLOT_VK_DEFINE)

namespace {
PFN_vkGetInstanceProcAddr get_proc = nullptr;

/// Mesa's disk cache does not tell vector widths apart: code cached at one width crashes at another (seen on 25.0.7).
void separate_mesa_caches() {
  const char* width = std::getenv("LP_NATIVE_VECTOR_WIDTH");
  if (!width || std::getenv("MESA_SHADER_CACHE_DIR")) return;
  const std::filesystem::path folder = cache_folder() / (std::string("mesa-width-") + width);
  std::error_code ignored;
  std::filesystem::create_directories(folder, ignored);
  setenv("MESA_SHADER_CACHE_DIR", folder.c_str(), 0);
}

}  // namespace

void load_vulkan() {
  if (get_proc) return;
  separate_mesa_caches();
  const char* given = std::getenv("BALLOT_VULKAN_LOADER");
  void* loader = dlopen(given ? given : "libvulkan.so.1", RTLD_NOW | RTLD_LOCAL);
  if (!loader)
    fail(Failure::Device,
         "no Vulkan loader: {} was not found; install it with a driver, on Debian: "
         "apt install libvulkan1 mesa-vulkan-drivers",
         given ? given : "libvulkan.so.1");
  get_proc = reinterpret_cast<PFN_vkGetInstanceProcAddr>(dlsym(loader, "vkGetInstanceProcAddr"));
  if (!get_proc) fail(Failure::Device, "libvulkan.so.1 has no vkGetInstanceProcAddr; reinstall the Vulkan loader");
#define BALLOT_VK_LOAD(f) f = reinterpret_cast<PFN_##f>(get_proc(nullptr, #f));
  BALLOT_VK_GLOBAL(BALLOT_VK_LOAD)
#undef BALLOT_VK_LOAD
  if (!vkEnumerateInstanceVersion)
    fail(Failure::Device, "the Vulkan loader is older than Vulkan 1.1; Ballot needs Vulkan 1.2");
}

void load_instance_functions(VkInstance instance, bool debug, bool surface) {
#define BALLOT_VK_LOAD(f) f = reinterpret_cast<PFN_##f>(get_proc(instance, #f));
  BALLOT_VK_INSTANCE(BALLOT_VK_LOAD)
  BALLOT_VK_DRAWING(BALLOT_VK_LOAD)
  BALLOT_VK_STATISTICS(BALLOT_VK_LOAD)
#undef BALLOT_VK_LOAD
#define BALLOT_VK_LOAD(f) f = debug ? reinterpret_cast<PFN_##f>(get_proc(instance, #f)) : nullptr;
  BALLOT_VK_DEBUG(BALLOT_VK_LOAD)
#undef BALLOT_VK_LOAD
#define BALLOT_VK_LOAD(f) f = surface ? reinterpret_cast<PFN_##f>(get_proc(instance, #f)) : nullptr;
  BALLOT_VK_SURFACE(BALLOT_VK_LOAD)
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
      return "a VkResult without a name here";
  }
}

void vk_check(VkResult result, const char* what, const char* object) {
  if (result == VK_SUCCESS) return;
  const char* hint = "";
  if (result == VK_ERROR_OUT_OF_DEVICE_MEMORY) hint = "; the device has too little free memory for it";
  if (result == VK_ERROR_DEVICE_LOST) hint = "; the driver gave the device up (see the system log)";
  fail(Failure::Work, "{}{}{}: {}{}", what, *object ? " " : "", object, result_name(result), hint);
}

}  // namespace ballot
