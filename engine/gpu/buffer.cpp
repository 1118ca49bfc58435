#include "engine/gpu/buffer.h"

#include <algorithm>
#include <bit>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/parallel.h"

namespace ballot {

namespace {

// Larger transfers go in parts. A GPU's driver clears and pins all of this memory before the first transfer.
constexpr std::uint64_t kStagingBytes = 16ull << 20;

std::string mib(std::uint64_t bytes) { return fmt::format("{:.1f} MiB", double(bytes) / (1 << 20)); }

void check_limits(const DeviceInfo& d, const std::string& name, std::uint64_t bytes, Access access) {
  const bool fits_texels = !has(access, Access::Texel) && bytes / 16 <= d.max_texels && bytes <= d.max_allocation;
  const auto refuse = [&](const char* limit, std::uint64_t most) {
    fail(Failure::Work, "buffer '{}' needs {}, but {} of {} is {}; use a smaller scene{} or another --device", name,
         mib(bytes), limit, d.name, mib(most), fits_texels && name.starts_with("bvh ") ? ", --knob fetch=texel" : "");
  };
  if (has(access, Access::Storage) && !has(access, Access::Parts) && bytes > d.max_storage_range)
    refuse("maxStorageBufferRange", d.max_storage_range);
  if (has(access, Access::Texel) && bytes / 16 > d.max_texels) refuse("maxTexelBufferElements", d.max_texels * 16);
  if (bytes > d.max_buffer)
    refuse(d.max_buffer == d.max_allocation ? "maxMemoryAllocationSize" : "maxBufferSize", d.max_buffer);
}

/// Returns a size of at least `bytes` with which a texel view needs no kernel of its own on llvmpipe. llvmpipe
/// recompiles a kernel, which takes half a second and more, when the size of a texel view changes from or to a power of
/// two. It also does so when bits 8 to 15 of the size change from or to zero, as it takes them for a mip level. The
/// returned size is no power of two, and some of these bits are set, so one compiled kernel serves all scenes and
/// batches.
std::uint64_t steady_size(std::uint64_t bytes) {
  while (std::has_single_bit(bytes) || (bytes & 0xFF00) == 0) bytes = (bytes / 16 + 1) * 16;
  return bytes;
}

void copy_bytes(void* to, const void* from, std::uint64_t bytes) {
  copy_parallel(std::span(static_cast<const std::byte*>(from), bytes), std::span(static_cast<std::byte*>(to), bytes));
}

}  // namespace

/// The host-visible staging buffer of a context: transfers of buffers that are not mapped go through it.
struct Staging {
  Context& gpu;
  VkBuffer buffer = VK_NULL_HANDLE;
  VkDeviceMemory memory = VK_NULL_HANDLE;
  std::byte* mapped = nullptr;

  explicit Staging(Context& context) : gpu(context) {
    try {
      allocate();
    } catch (...) {
      destroy();
      throw;
    }
  }
  ~Staging() { destroy(); }
  Staging(const Staging&) = delete;
  Staging& operator=(const Staging&) = delete;

  void allocate() {
    VkBufferCreateInfo create{};
    create.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
    create.size = kStagingBytes;
    create.usage = VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT;
    vk_check(gpu.vk().CreateBuffer(gpu.device(), &create, nullptr, &buffer), "creating buffer", "staging");
    VkMemoryRequirements needs;
    gpu.vk().GetBufferMemoryRequirements(gpu.device(), buffer, &needs);
    VkMemoryAllocateInfo allocate{};
    allocate.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO;
    allocate.allocationSize = needs.size;
    allocate.memoryTypeIndex = gpu.memory_type(
        needs.memoryTypeBits, VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT,
        VK_MEMORY_PROPERTY_HOST_CACHED_BIT);
    vk_check(gpu.vk().AllocateMemory(gpu.device(), &allocate, nullptr, &memory), "allocating buffer", "staging");
    vk_check(gpu.vk().BindBufferMemory(gpu.device(), buffer, memory, 0), "binding buffer", "staging");
    void* pointer = nullptr;
    vk_check(gpu.vk().MapMemory(gpu.device(), memory, 0, VK_WHOLE_SIZE, 0, &pointer), "mapping buffer", "staging");
    mapped = static_cast<std::byte*>(pointer);
    gpu.name(VK_OBJECT_TYPE_BUFFER, std::uint64_t(buffer), "staging");
  }
  void destroy() {
    gpu.vk().DestroyBuffer(gpu.device(), buffer, nullptr);
    gpu.vk().FreeMemory(gpu.device(), memory, nullptr);
  }
};

RawBuffer::RawBuffer(Context& gpu, std::uint64_t bytes, Access access, std::string name)
    : gpu_(&gpu),
      bytes_(std::max<std::uint64_t>(16, bytes)),
      id_(gpu.next_buffer_id()),
      access_(access),
      name_(std::move(name)) {
  check_limits(gpu.info(), name_, bytes_, access);
  if (has(access, Access::Exported) && !gpu.info().memory_fd)
    fail(Failure::Work, "buffer '{}': {} ({}) cannot share its memory with other interfaces: it lacks {}", name_,
         gpu.info().name, gpu.info().driver, VK_KHR_EXTERNAL_MEMORY_FD_EXTENSION_NAME);
  if (gpu.info().is_cpu() && has(access, Access::Storage) && bytes_ / 16 <= gpu.info().max_texels)
    access = access | Access::Texel;
  try {
    allocate(access);
  } catch (...) {
    destroy();
    throw;
  }
}

void RawBuffer::allocate(Access access) {
  VkBufferCreateInfo create{};
  create.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
  create.size = gpu_->info().is_cpu() && has(access, Access::Texel) ? steady_size(bytes_) : bytes_;
  create.usage = VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT;
  if (has(access, Access::Storage)) create.usage |= VK_BUFFER_USAGE_STORAGE_BUFFER_BIT;
  if (has(access, Access::Texel)) create.usage |= VK_BUFFER_USAGE_UNIFORM_TEXEL_BUFFER_BIT;
  if (has(access, Access::Address)) create.usage |= VK_BUFFER_USAGE_SHADER_DEVICE_ADDRESS_BIT;
  if (has(access, Access::Indirect)) create.usage |= VK_BUFFER_USAGE_INDIRECT_BUFFER_BIT;
  if (has(access, Access::Uniform)) create.usage |= VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT;
  VkExternalMemoryBufferCreateInfo external{};
  external.sType = VK_STRUCTURE_TYPE_EXTERNAL_MEMORY_BUFFER_CREATE_INFO;
  external.handleTypes = VK_EXTERNAL_MEMORY_HANDLE_TYPE_OPAQUE_FD_BIT;
  const bool is_exported = has(access, Access::Exported);
  if (is_exported) create.pNext = &external;
  vk_check(gpu_->vk().CreateBuffer(gpu_->device(), &create, nullptr, &buffer_), "creating buffer", name_.c_str());
  VkMemoryRequirements needs;
  gpu_->vk().GetBufferMemoryRequirements(gpu_->device(), buffer_, &needs);
  const VkMemoryPropertyFlags host = VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
  const bool hosted = has(access, Access::Host);
  const bool shared = hosted || gpu_->info().is_cpu() || gpu_->info().type == VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU;
  VkMemoryAllocateFlagsInfo flags{};
  flags.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_FLAGS_INFO;
  flags.flags = VK_MEMORY_ALLOCATE_DEVICE_ADDRESS_BIT;
  VkMemoryAllocateInfo allocate{};
  allocate.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO;
  VkExportMemoryAllocateInfo exported{};
  exported.sType = VK_STRUCTURE_TYPE_EXPORT_MEMORY_ALLOCATE_INFO;
  exported.handleTypes = external.handleTypes;
  if (has(access, Access::Address)) allocate.pNext = &flags;
  if (is_exported) exported.pNext = allocate.pNext, allocate.pNext = &exported;
  allocate.allocationSize = needs.size;
  allocate.memoryTypeIndex =
      hosted ? gpu_->memory_type(needs.memoryTypeBits, host, VK_MEMORY_PROPERTY_HOST_CACHED_BIT)
             : gpu_->memory_type(needs.memoryTypeBits, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT, shared ? host : 0);
  if (needs.size > gpu_->heap_bytes(allocate.memoryTypeIndex))
    fail(Failure::Work, "buffer '{}' needs {}, but the memory of {} is {}; use a smaller scene or another --device",
         name_, mib(needs.size), gpu_->info().name, mib(gpu_->heap_bytes(allocate.memoryTypeIndex)));
  allocated_ = needs.size;
  const std::string what = fmt::format("{} ({})", name_, mib(needs.size));
  vk_check(gpu_->vk().AllocateMemory(gpu_->device(), &allocate, nullptr, &memory_), "allocating buffer", what.c_str());
  vk_check(gpu_->vk().BindBufferMemory(gpu_->device(), buffer_, memory_, 0), "binding buffer", name_.c_str());
  gpu_->name(VK_OBJECT_TYPE_BUFFER, std::uint64_t(buffer_), name_);
  if (shared && (gpu_->memory_flags(allocate.memoryTypeIndex) & host) == host) {
    void* pointer = nullptr;
    vk_check(gpu_->vk().MapMemory(gpu_->device(), memory_, 0, VK_WHOLE_SIZE, 0, &pointer), "mapping buffer",
             name_.c_str());
    mapped_ = static_cast<std::byte*>(pointer);
  }
  if (has(access, Access::Address)) {
    VkBufferDeviceAddressInfo info{VK_STRUCTURE_TYPE_BUFFER_DEVICE_ADDRESS_INFO, nullptr, buffer_};
    address_ = gpu_->vk().GetBufferDeviceAddress(gpu_->device(), &info);
  }
  if (has(access, Access::Texel)) make_view(create.size);
}

void RawBuffer::make_view(std::uint64_t bytes) {
  VkBufferViewCreateInfo view{};
  view.sType = VK_STRUCTURE_TYPE_BUFFER_VIEW_CREATE_INFO;
  view.buffer = buffer_;
  view.offset = offset_;
  view.format = VK_FORMAT_R32G32B32A32_UINT;
  view.range = std::min(bytes / 16, gpu_->info().max_texels) * 16;
  vk_check(gpu_->vk().CreateBufferView(gpu_->device(), &view, nullptr, &view_), "creating a texel view of buffer",
           name_.c_str());
}

RawBuffer::~RawBuffer() { destroy(); }

void RawBuffer::destroy() {
  if (!gpu_) return;
  try {
    gpu_->finish();
  } catch (const Error&) {
    gpu_->abandon();  // the next call that waits reports the error
  }
  gpu_->vk().DestroyBufferView(gpu_->device(), view_, nullptr);
  gpu_->unname(VK_OBJECT_TYPE_BUFFER, std::uint64_t(buffer_));
  gpu_->vk().DestroyBuffer(gpu_->device(), buffer_, nullptr);
  gpu_->vk().FreeMemory(gpu_->device(), memory_, nullptr);
  gpu_ = nullptr;
}

RawBuffer& RawBuffer::operator=(RawBuffer&& other) noexcept {
  std::swap(gpu_, other.gpu_);
  std::swap(bytes_, other.bytes_);
  std::swap(offset_, other.offset_);
  std::swap(id_, other.id_);
  std::swap(allocated_, other.allocated_);
  std::swap(access_, other.access_);
  std::swap(name_, other.name_);
  std::swap(buffer_, other.buffer_);
  std::swap(memory_, other.memory_);
  std::swap(view_, other.view_);
  std::swap(address_, other.address_);
  std::swap(mapped_, other.mapped_);
  return *this;
}

int RawBuffer::export_fd() const {
  if (!has(access_, Access::Exported)) fail(Failure::Arguments, "buffer '{}' was not made to be exported", name_);
  VkMemoryGetFdInfoKHR get{};
  get.sType = VK_STRUCTURE_TYPE_MEMORY_GET_FD_INFO_KHR;
  get.memory = memory_;
  get.handleType = VK_EXTERNAL_MEMORY_HANDLE_TYPE_OPAQUE_FD_BIT;
  int fd = -1;
  vk_check(gpu_->vk().GetMemoryFdKHR(gpu_->device(), &get, &fd), "exporting the memory of buffer", name_.c_str());
  return fd;
}

void RawBuffer::upload(std::uint64_t offset, const void* data, std::uint64_t bytes) {
  copy(offset, nullptr, data, bytes);
}

void RawBuffer::download(std::uint64_t offset, void* data, std::uint64_t bytes) const {
  copy(offset, data, nullptr, bytes);
}

void RawBuffer::record_upload(std::uint64_t offset, const void* data, std::uint64_t bytes) {
  constexpr std::uint64_t kMost = 65536, kWord = 4;  // Commands::write()
  if (mapped_ || bytes > kMost || bytes % kWord || offset % kWord) return upload(offset, data, bytes);
  if (bytes == 0) return;
  check_fits(offset, bytes);
  gpu_->pass("an upload of " + name_, [&](Commands& cmd) { cmd.write(*this, offset, data, bytes); });
}

void RawBuffer::copy_from(const RawBuffer& other, std::uint64_t other_offset, std::uint64_t offset,
                          std::uint64_t bytes) {
  const Part part{other_offset, offset, bytes};
  copy_parts(other, {&part, 1});
}

void RawBuffer::copy_parts(const RawBuffer& other, std::span<const Part> parts) {
  std::vector<VkBufferCopy> regions;
  for (const Part& p : parts) {
    if (p.bytes == 0) continue;
    if (p.to + p.bytes > bytes_ || p.from + p.bytes > other.bytes_)
      fail(Failure::Work,
           "buffer '{}' of {} bytes: a copy of {} bytes to offset {} does not fit; it comes from buffer '{}' of "
           "{} bytes, offset {}",
           name_, bytes_, p.bytes, p.to, other.name_, other.bytes_, p.from);
    regions.push_back({other.offset_ + p.from, offset_ + p.to, p.bytes});
  }
  if (regions.empty()) return;
  gpu_->submit("a copy of " + other.name_, [&](Commands& cmd) {
    gpu_->vk().CmdCopyBuffer(cmd.handle(), other.buffer_, buffer_, std::uint32_t(regions.size()), regions.data());
  });
}

void RawBuffer::check_fits(std::uint64_t offset, std::uint64_t bytes) const {
  if (offset + bytes > bytes_)
    fail(Failure::Work, "buffer '{}' of {} bytes: a copy of {} bytes at offset {} does not fit", name_, bytes_, bytes,
         offset);
}

void RawBuffer::copy(std::uint64_t offset, void* to, const void* from, std::uint64_t bytes) const {
  if (bytes == 0) return;
  check_fits(offset, bytes);
  if (mapped_) {
    gpu_->finish();
    if (from) copy_bytes(mapped_ + offset, from, bytes);
    if (to) copy_bytes(to, mapped_ + offset, bytes);
    return;
  }
  if (!gpu_->staging()) gpu_->staging() = std::make_shared<Staging>(*gpu_);
  const Staging& staging = *gpu_->staging();
  for (std::uint64_t done = 0; done < bytes; done += kStagingBytes) {
    const std::uint64_t part = std::min(bytes - done, kStagingBytes);
    if (from) copy_bytes(staging.mapped, static_cast<const std::byte*>(from) + done, part);
    gpu_->submit("a copy of " + name_, [&](Commands& cmd) {
      const VkBufferCopy region{from ? 0 : offset + done, from ? offset + done : 0, part};
      gpu_->vk().CmdCopyBuffer(cmd.handle(), from ? staging.buffer : buffer_, from ? buffer_ : staging.buffer, 1,
                               &region);
    });
    if (to) copy_bytes(static_cast<std::byte*>(to) + done, staging.mapped, part);
  }
}

}  // namespace ballot
