// The limit on the nesting of JSON, which is checked before a parser sees the text.
#pragma once

#include <filesystem>
#include <string_view>

namespace ballot {

/// The most brackets of JSON that may be open at once. The libraries that convert, print and destroy JSON recurse, so
/// deeper texts would overflow the stack.
inline constexpr int kMaxJsonDepth = 256;

/// Throws Error(Work) "PATH: ..." if the JSON text nests deeper than kMaxJsonDepth. Accepts any other text, valid or
/// not.
void check_json_depth(const std::filesystem::path& path, std::string_view json);

}  // namespace ballot
