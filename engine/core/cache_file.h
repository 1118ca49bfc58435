// Files of the caches. They only save time: one that is missing, damaged or not to be trusted counts as missing. One
// line on standard error tells of the first damaged one.
//
// What a cache holds goes to the device and its driver unparsed, and is written at names that can be foretold. So
// files are read and written through the descriptor of an open folder. Below the folder that the environment names
// (cache_folder() without its last part) no link is followed, and each folder belongs to the user of this process and
// can be written by this user alone. The folder that the environment names belongs to the user or to root. Where this
// does not hold, or where nothing can be written, there is no cache, and one line on standard error says why.
#pragma once

#include <cstddef>
#include <filesystem>
#include <initializer_list>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/core/file.h"

namespace ballot {

/// Opens a cache file. It is a regular file, no link, of the user alone. Returns null if there is none.
InputStream open_cache(const std::filesystem::path& path);

/// Returns the bytes of a cache file; nothing if open_cache() returns null or there is too little memory.
std::optional<std::vector<std::byte>> read_cache(const std::filesystem::path& path);

/// Writes the parts of a cache file one behind the other, atomically. Makes its folder and those above it that are
/// missing, for this user alone. A link or a pipe of its name is replaced. Returns false if that fails, which only
/// costs time.
bool write_cache(const std::filesystem::path& path, std::initializer_list<std::span<const std::byte>> parts);
bool write_cache(const std::filesystem::path& path, std::span<const std::byte> bytes);

/// Prints that a file of a cache is not what this version writes, and is made anew: once in the life of a process.
void say_damaged_cache(const std::filesystem::path& path);

/// Prepares the cache that Mesa's drivers keep themselves, before one is loaded: in MESA_SHADER_CACHE_DIR if that is
/// set, else in cache_folder(). Mesa maps a file there, and a process that touches a page of it for which the disk
/// has no room is killed (SIGBUS), so that file gets all its room here. Where there is none, or where the folder could
/// be another user's, Mesa's cache is turned off by MESA_SHADER_CACHE_DISABLE, and one line says why. Sets variables
/// of the environment, in the first call of a process alone: a program makes it before it starts threads.
void prepare_driver_cache();

}  // namespace ballot
