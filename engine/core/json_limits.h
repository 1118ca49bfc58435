// The limits on JSON, which are checked before a parser sees the text: how deep it nests, and the memory that it takes.
#pragma once

#include <filesystem>
#include <string_view>

namespace ballot {

/// The most brackets of JSON that may be open at once. The libraries that convert, print and destroy JSON recurse, so
/// deeper texts would overflow the stack.
inline constexpr int kMaxJsonDepth = 256;

/// Throws Error(Work) "PATH: ..." if the JSON text nests deeper than kMaxJsonDepth, or if there is no memory (memory.h)
/// for what nlohmann::json makes of so many values. Accepts any other text, valid or not.
void check_json(const std::filesystem::path& path, std::string_view json);

}  // namespace ballot
