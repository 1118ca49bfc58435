// A file is a checksum and the texels behind it. Its name is the key.
#include "engine/tree/formats/encoded_cache.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <cstring>
#include <optional>

#include "engine/core/cache_file.h"
#include "engine/core/error.h"

namespace ballot {
namespace {

// Part of every key. Raise it whenever an encoder writes other texels for the same pairs.
constexpr std::uint32_t kEncoders = 1;

// Trees of fewer pairs are encoded sooner than a file is read.
constexpr std::size_t kLeastTexels = 1024;

std::string file_name(const TreeFormat& format, const PairTree& pairs, std::uint32_t size) {
  const XXH128_hash_t nodes = XXH3_128bits(pairs.nodes.data(), pairs.nodes.size() * sizeof(glm::uvec4));
  const struct {
    XXH128_hash_t nodes;
    std::uint32_t encoders, layout, root, size;
    Bounds root_box;
    glm::vec3 origin;
    std::uint32_t spare;
  } all{nodes, kEncoders, std::uint32_t(pairs.layout), pairs.root, size, pairs.root_box, pairs.origin, 0};
  static_assert(sizeof(all) == 72, "hashed bytes must have no padding");
  const XXH128_hash_t key = XXH3_128bits(&all, sizeof(all));
  return fmt::format("{:016x}{:016x}.{}", key.high64, key.low64, format.name);
}

std::optional<std::vector<glm::uvec4>> load_texels(const std::filesystem::path& path) {
  const auto bytes = read_cache(path);
  if (!bytes) return std::nullopt;
  XXH128_hash_t checksum{};
  const bool whole = bytes->size() >= sizeof(checksum) && bytes->size() % sizeof(glm::uvec4) == 0;
  if (whole) std::memcpy(&checksum, bytes->data(), sizeof(checksum));
  const std::span<const std::byte> texels = std::span(*bytes).subspan(whole ? sizeof(checksum) : 0);
  if (!whole || !XXH128_isEqual(checksum, XXH3_128bits(texels.data(), texels.size()))) {
    say_damaged_cache(path);
    return std::nullopt;
  }
  std::vector<glm::uvec4> out(texels.size() / sizeof(glm::uvec4));
  std::memcpy(out.data(), texels.data(), texels.size());
  return out;
}

void save_texels(const std::filesystem::path& path, std::span<const glm::uvec4> texels) {
  const XXH128_hash_t checksum = XXH3_128bits(texels.data(), texels.size_bytes());
  std::vector<std::byte> bytes(sizeof(checksum) + texels.size_bytes());
  std::memcpy(bytes.data(), &checksum, sizeof(checksum));
  std::memcpy(bytes.data() + sizeof(checksum), texels.data(), texels.size_bytes());
  write_cache(path, bytes);
}

}  // namespace

std::vector<glm::uvec4> encode_cached(const TreeFormat& format, const PairTree& pairs, std::uint32_t size,
                                      const std::filesystem::path& folder) {
  if (folder.empty() || !format.collapsed() || pairs.nodes.size() < kLeastTexels) return format.encode(pairs, size);
  const std::filesystem::path path = folder / file_name(format, pairs, size);
  if (auto stored = load_texels(path)) return std::move(*stored);
  std::vector<glm::uvec4> texels = format.encode(pairs, size);
  save_texels(path, texels);
  return texels;
}

}  // namespace ballot
