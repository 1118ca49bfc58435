// Files of the caches. They only save time: one that is missing, damaged or not to be trusted counts as missing.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <vector>

namespace ballot {

/// Returns true if no other user can have made a file: it is a regular file, it and its folder belong to the user of
/// this process or to root, and neither can be written by all. Caches are read on this condition alone, because what
/// they hold goes to the device and its driver unparsed.
bool is_own_file(const std::filesystem::path& path);

/// Returns the bytes of a cache file; nothing if it cannot be read or is_own_file() is false.
std::optional<std::vector<std::byte>> read_cache(const std::filesystem::path& path);

/// Writes a cache file, atomically, and makes its folder if it is missing, for this user alone. Returns false if that
/// fails, which only costs time.
bool write_cache(const std::filesystem::path& path, std::span<const std::byte> bytes);

/// Makes the folder of a cache and those above it that are missing, for this user alone. Throws Error(Work).
void make_cache_folder(const std::filesystem::path& folder);

}  // namespace ballot
