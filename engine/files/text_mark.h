// The byte order mark at the start of texts.
#pragma once

#include <filesystem>
#include <string_view>

namespace ballot {

/// Returns a text without the byte order mark of UTF-8, which Windows puts before it. Throws Error(Work) "PATH: ..." if
/// it begins with the mark of UTF-16 or UTF-32.
std::string_view without_mark(const std::filesystem::path& path, std::string_view text);

}  // namespace ballot
