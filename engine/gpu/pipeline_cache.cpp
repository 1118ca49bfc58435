// The pipelines of a device on disk: what the driver gives, behind a line of this program's with its checksum. A driver
// takes such data as its own, so a damaged file must not reach it.
#define XXH_INLINE_ALL
#include <xxhash.h>

#include <cstring>

#include "engine/core/cache_file.h"
#include "engine/core/file.h"
#include "engine/gpu/context.h"

namespace ballot {

namespace {

struct PipelineFileStart {
  std::uint64_t magic = 0x4C495054'4C4C4142;  // "BALLTPIL" on little-endian machines
  XXH128_hash_t checksum{};                   // of all bytes behind
};

std::filesystem::path pipeline_cache_path(const DeviceInfo& d) {
  std::string uuid;
  for (std::uint8_t byte : d.pipeline_cache_uuid) uuid += fmt::format("{:02x}", byte);
  return cache_folder() / "pipelines" / fmt::format("{:04x}-{:04x}-{}.bin", d.vendor_id, d.device_id, uuid);
}

/// Returns the driver's data of a file; nothing if it is not what save_pipeline_cache() wrote.
std::span<const std::byte> driver_data(std::span<const std::byte> file) {
  PipelineFileStart expected, start;
  if (file.size() < sizeof start) return {};
  std::memcpy(&start, file.data(), sizeof start);
  const std::span<const std::byte> data = file.subspan(sizeof start);
  const bool good =
      start.magic == expected.magic && XXH128_isEqual(start.checksum, XXH3_128bits(data.data(), data.size())) != 0;
  return good ? data : std::span<const std::byte>();
}

}  // namespace

void Context::load_pipeline_cache() {
  const std::filesystem::path path = pipeline_cache_path(info_);
  const auto file = read_cache(path);
  const std::span<const std::byte> data = file ? driver_data(*file) : std::span<const std::byte>();
  if (file && data.empty()) say_damaged_cache(path);
  VkPipelineCacheCreateInfo create{};
  create.sType = VK_STRUCTURE_TYPE_PIPELINE_CACHE_CREATE_INFO;
  create.initialDataSize = data.size();
  create.pInitialData = data.data();
  vk_check(vk_.CreatePipelineCache(device_, &create, nullptr, &pipeline_cache_), "creating the pipeline cache");
  if (!data.empty()) stored_bytes_ = pipeline_cache_bytes();
}

/// Returns the size of what the driver would store now; 0 if it does not tell.
std::size_t Context::pipeline_cache_bytes() const {
  std::size_t size = 0;
  return vk_.GetPipelineCacheData(device_, pipeline_cache_, &size, nullptr) == VK_SUCCESS ? size : 0;
}

// Drivers add to a cache and take nothing away, so what has the size of the file is what the file holds.
void Context::save_pipeline_cache() {
  std::size_t size = pipeline_cache_bytes();
  if (size == 0 || size == stored_bytes_) return;
  stored_bytes_ = size;
  PipelineFileStart start;
  std::vector<std::byte> file(sizeof start + size);
  if (vk_.GetPipelineCacheData(device_, pipeline_cache_, &size, file.data() + sizeof start) != VK_SUCCESS) return;
  file.resize(sizeof start + size);
  start.checksum = XXH3_128bits(file.data() + sizeof start, size);
  std::memcpy(file.data(), &start, sizeof start);
  write_cache(pipeline_cache_path(info_), file);
}

}  // namespace ballot
