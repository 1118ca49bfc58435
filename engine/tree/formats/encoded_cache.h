// The cache on disk of tree formats that take long to encode (TreeFormat::collapsed()).
#pragma once

#include <filesystem>

#include "engine/tree/formats/formats.h"

namespace ballot {

/// Returns format.encode(pairs, size), through a cache on disk. The key is made of the pairs' bytes and the format. A
/// file that is damaged, does not match or may be another user's is ignored and replaced. One that cannot be written
/// only costs time. An empty `folder`: no cache.
std::vector<glm::uvec4> encode_cached(const TreeFormat& format, const PairTree& pairs, std::uint32_t size,
                                      const std::filesystem::path& folder);

}  // namespace ballot
