#include "engine/gpu/given.h"

#include <algorithm>

#include "engine/core/error.h"
#include "engine/gpu/context.h"
#include "engine/gpu/device.h"

namespace ballot {

namespace {

std::string version_text(std::uint32_t version) {
  return fmt::format("{}.{}", VK_API_VERSION_MAJOR(version), VK_API_VERSION_MINOR(version));
}

void check_given(const GivenVulkan& given) {
  const std::pair<const void*, const char*> handles[] = {{given.instance, "instance, a VkInstance"},
                                                         {given.physical_device, "physical_device, a VkPhysicalDevice"},
                                                         {given.device, "device, a VkDevice"},
                                                         {given.queue, "queue, a VkQueue"}};
  for (const auto& [handle, what] : handles)
    if (!handle) fail(Failure::Arguments, "vulkan: there is no {}", what);
  if (!given.lock != !given.unlock)
    fail(Failure::Arguments, "vulkan: there is {} without {}; give both or none", given.lock ? "lock" : "unlock",
         given.lock ? "unlock" : "lock");
  if (given.api_version && given.api_version < VK_API_VERSION_1_2)
    fail(Failure::Device, "vulkan: api_version is {}, Ballot needs 1.2: ask for it in VkApplicationInfo",
         version_text(given.api_version));
}

}  // namespace

void Context::adopt(const GivenVulkan& given) {
  check_given(given);
  vk_.load_instance(
      static_cast<VkInstance>(given.instance),
      given.find ? reinterpret_cast<PFN_vkGetInstanceProcAddr>(given.find) : vulkan_loader().GetInstanceProcAddr, false,
      false);
  const std::vector<PhysicalDevice> devices = physical_devices(vk_, static_cast<VkInstance>(given.instance));
  const auto found = std::ranges::find(devices, given.physical_device,
                                       [](const PhysicalDevice& d) { return static_cast<void*>(d.handle); });
  if (found == devices.end())
    fail(Failure::Arguments, "vulkan: physical_device is none of the {} devices of instance", devices.size());
  physical_ = found->handle;
  info_ = found->info;
  if (!info_.refusals.empty())
    fail(Failure::Device, "vulkan: {} ({}) is refused: {}", info_.name, info_.driver, fmt::join(info_.refusals, "; "));
  take_what_is_off(given.enabled, info_);
  take_queue(vk_, physical_, given.queue_family, info_);
  info_.lacks = lacks_of(info_);
  queue_family_ = given.queue_family;
  vk_.load_device(static_cast<VkDevice>(given.device));
  given_ = given;
  device_ = static_cast<VkDevice>(given.device);
  queue_ = static_cast<VkQueue>(given.queue);
}

VkResult Context::submit_to_queue(const VkSubmitInfo& submit, VkFence fence) {
  if (given_ && given_->lock) given_->lock(given_->user);
  const VkResult result = vk_.QueueSubmit(queue_, 1, &submit, fence);
  if (given_ && given_->unlock) given_->unlock(given_->user);
  return result;
}

}  // namespace ballot
