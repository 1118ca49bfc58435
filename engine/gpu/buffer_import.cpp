// Buffers over memory of the host, which the device uses in place (VK_EXT_external_memory_host).
#include <algorithm>
#include <cstdint>

#include "engine/core/error.h"
#include "engine/gpu/buffer.h"

namespace ballot {

bool RawBuffer::can_import(const Context& gpu, const void* host) {
  const DeviceInfo& d = gpu.info();
  return d.host_page && reinterpret_cast<std::uintptr_t>(host) % d.buffer_alignment == 0;
}

RawBuffer::RawBuffer(Context& gpu, std::span<std::byte> host, std::string name)
    : gpu_(&gpu), bytes_(host.size()), id_(gpu.next_buffer_id()), name_(std::move(name)) {
  if (bytes_ < 16 || !can_import(gpu, host.data()))
    fail(Failure::Work,
         "buffer '{}': {} cannot import {} bytes of host memory; expected VK_EXT_external_memory_host, at least 16 "
         "bytes "
         "and an address that is a multiple of {}",
         name_, gpu.info().name, bytes_, gpu.info().buffer_alignment);
  try {
    import(host);
  } catch (...) {
    destroy();
    throw;
  }
}

// Whole pages are imported; the device touches the bytes of `host` alone.
void RawBuffer::import(std::span<std::byte> host) {
  constexpr VkExternalMemoryHandleTypeFlagBits kHost = VK_EXTERNAL_MEMORY_HANDLE_TYPE_HOST_ALLOCATION_BIT_EXT;
  const std::uint64_t page = gpu_->info().host_page;
  const auto at = reinterpret_cast<std::uintptr_t>(host.data());
  offset_ = at % page;
  void* const first = host.data() - offset_;
  VkExternalMemoryBufferCreateInfo external{};
  external.sType = VK_STRUCTURE_TYPE_EXTERNAL_MEMORY_BUFFER_CREATE_INFO;
  external.handleTypes = kHost;
  VkBufferCreateInfo create{};
  create.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
  create.pNext = &external;
  create.size = offset_ + bytes_;
  create.usage = VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT |
                 VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT;
  vk_check(gpu_->vk().CreateBuffer(gpu_->device(), &create, nullptr, &buffer_), "creating buffer", name_.c_str());
  VkMemoryRequirements needs;
  gpu_->vk().GetBufferMemoryRequirements(gpu_->device(), buffer_, &needs);
  VkMemoryHostPointerPropertiesEXT properties{};
  properties.sType = VK_STRUCTURE_TYPE_MEMORY_HOST_POINTER_PROPERTIES_EXT;
  vk_check(gpu_->vk().GetMemoryHostPointerPropertiesEXT(gpu_->device(), kHost, first, &properties), "importing buffer",
           name_.c_str());
  VkImportMemoryHostPointerInfoEXT import_info{};
  import_info.sType = VK_STRUCTURE_TYPE_IMPORT_MEMORY_HOST_POINTER_INFO_EXT;
  import_info.handleType = kHost;
  import_info.pHostPointer = first;
  VkMemoryAllocateInfo allocate{};
  allocate.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO;
  allocate.pNext = &import_info;
  allocate.allocationSize = allocated_ = (create.size + page - 1) / page * page;
  allocate.memoryTypeIndex =
      gpu_->memory_type(needs.memoryTypeBits & properties.memoryTypeBits,
                        VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT, 0);
  if (needs.size > allocated_)
    fail(Failure::Work, "buffer '{}': {} needs {} bytes; the imported pages have {}", name_, gpu_->info().name,
         needs.size, allocated_);
  vk_check(gpu_->vk().AllocateMemory(gpu_->device(), &allocate, nullptr, &memory_), "importing buffer", name_.c_str());
  vk_check(gpu_->vk().BindBufferMemory(gpu_->device(), buffer_, memory_, 0), "binding buffer", name_.c_str());
  gpu_->name(VK_OBJECT_TYPE_BUFFER, std::uint64_t(buffer_), name_);
  mapped_ = host.data();
  if (bytes_ / 16 <= gpu_->info().max_texels) make_view(bytes_);
}

}  // namespace ballot
