// The file of a cached tree, for tests that change it behind its checksum. The layout is that of
// engine/tree/host/cache.cpp.
#pragma once

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <cstring>
#include <string>

#include "engine/tree/host/bvh.h"

namespace ballot::tree_file {

inline constexpr std::size_t kHeader = 104;  // bytes, then nodes, then references
inline constexpr std::size_t kChecksumAt = 24, kNodesAt = 40, kLeavesAt = 64, kDepthAt = 68;

/// Gives a file the checksum of its content. Does nothing to one that is too short for what it states.
inline void sign(std::string& bytes) {
  if (bytes.size() < kHeader) return;
  std::uint64_t nodes = 0;
  std::memcpy(&nodes, bytes.data() + kNodesAt, sizeof nodes);
  const std::uint64_t body = bytes.size() - kHeader, node_bytes = nodes * sizeof(BvhNode);
  if (nodes > body || node_bytes > body) return;
  std::memset(bytes.data() + kChecksumAt, 0, sizeof(XXH128_hash_t));
  const char* const content = bytes.data() + kHeader;
  const XXH128_hash_t all[3] = {XXH3_128bits(bytes.data(), kHeader), XXH3_128bits(content, node_bytes),
                                XXH3_128bits(content + node_bytes, body - node_bytes)};
  const XXH128_hash_t sum = XXH3_128bits(all, sizeof all);
  std::memcpy(bytes.data() + kChecksumAt, &sum, sizeof sum);
}

}  // namespace ballot::tree_file
