// Lost devices: what is noted, and what the driver tells.
#include "engine/gpu/context.h"

namespace ballot {

namespace {

// With a time-out of 10 s, NVIDIA's driver 580 wakes up to 0.2 ms later from waits of 1.5 ms than without (H200).
constexpr std::uint64_t kPatience = UINT64_MAX;
constexpr std::chrono::microseconds kAsking{1000};

/// Returns a text of a driver as a part of a sentence.
std::string words_of(const char* text) {
  std::string words(text);
  while (words.ends_with('.') || words.ends_with(' ') || words.ends_with('\n')) words.pop_back();
  return words.empty() ? "no description" : words;
}

std::string address_text(const VkDeviceFaultAddressInfoEXT& a) {
  constexpr const char* kKinds[] = {"no address",
                                    "an invalid read at",
                                    "an invalid write at",
                                    "a fault at",
                                    "an unknown instruction at",
                                    "an invalid instruction at",
                                    "a failing instruction at"};
  const char* kind = std::size_t(a.addressType) < std::size(kKinds) ? kKinds[a.addressType] : "an address:";
  return fmt::format("{} {:#x} to within {} bytes", kind, a.reportedAddress, a.addressPrecision);
}

}  // namespace

VkResult Context::wait_for(VkFence fence) const {
  VkResult result = VK_TIMEOUT;
  // A thread that asks learns of the end at once, one that sleeps later: work of a GPU that is soon done is asked for.
  const auto start = std::chrono::steady_clock::now();
  while (!info_.is_cpu() && std::chrono::steady_clock::now() - start < kAsking) {
    result = vk_.GetFenceStatus(device_, fence);
    if (result != VK_NOT_READY) return result;
    result = VK_TIMEOUT;
  }
  while (result == VK_TIMEOUT) result = vk_.WaitForFences(device_, 1, &fence, VK_TRUE, kPatience);
  return result;
}

void Context::expect_device() const {
  if (is_lost()) throw DeviceLost(lost_);
}

void Context::check(VkResult result, const char* what, const char* object) {
  if (result != VK_ERROR_DEVICE_LOST) return vk_check(result, what, object);
  if (!is_lost())
    lost_ = fmt::format("device {} was lost while {}{}{}: VK_ERROR_DEVICE_LOST; {}; the system log may tell more",
                        info_.name, what, *object ? " " : "", object, fault_report());
  expect_device();
}

std::string Context::passes_of(const Slot& slot) const {
  if (slot.passes.size() < 2) return slot.what;
  return fmt::format("{} passes, from {} to {}", slot.passes.size(), slot.names.front(), slot.what);
}

std::string Context::fault_report() const {
  constexpr const char* kSilent = "the driver reports no reason";
  if (!vk_.GetDeviceFaultInfoEXT || !info_.fault_reports) return kSilent;
  VkDeviceFaultCountsEXT counts{};
  counts.sType = VK_STRUCTURE_TYPE_DEVICE_FAULT_COUNTS_EXT;
  if (vk_.GetDeviceFaultInfoEXT(device_, &counts, nullptr) != VK_SUCCESS) return kSilent;
  std::vector<VkDeviceFaultAddressInfoEXT> addresses(counts.addressInfoCount);
  std::vector<VkDeviceFaultVendorInfoEXT> notes(counts.vendorInfoCount);
  counts.vendorBinarySize = 0;
  VkDeviceFaultInfoEXT info{};
  info.sType = VK_STRUCTURE_TYPE_DEVICE_FAULT_INFO_EXT;
  info.pAddressInfos = addresses.data();
  info.pVendorInfos = notes.data();
  const VkResult result = vk_.GetDeviceFaultInfoEXT(device_, &counts, &info);
  if (result != VK_SUCCESS && result != VK_INCOMPLETE) return kSilent;
  std::string text = "the driver reports: " + words_of(info.description);
  for (const VkDeviceFaultAddressInfoEXT& each : addresses) text += ", " + address_text(each);
  for (const VkDeviceFaultVendorInfoEXT& each : notes)
    text += fmt::format(", {} ({:#x}, {:#x})", words_of(each.description), each.vendorFaultCode, each.vendorFaultData);
  return text;
}

}  // namespace ballot
