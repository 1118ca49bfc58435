// The words of a text in GLSL, and the names that it declares. Internal to engine/answer.
#pragma once

#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace ballot {

using Names = std::set<std::string, std::less<>>;

/// Returns true if a word is a name or a keyword.
bool is_name(std::string_view word);

/// Returns a text with blanks in the place of its comments.
std::string without_comments(std::string text);

/// The words of a text: names, numbers and single signs, which refer to it. Directives are apart from the rest.
struct Words {
  std::vector<std::string_view> code, directives;  // of directives without their '#'
  Names macros;                                    // that it defines
};

/// Returns the words of a text without comments.
Words words_of(std::string_view text);

/// Returns the names that are declared for the whole text: of functions, variables, constants and structs. It takes
/// every name outside of all brackets for one that something follows which can follow a declared name.
Names declared_by(const std::vector<std::string_view>& code);

/// Returns the names of members of blocks, which are declared for the whole text where a block has no name of its own.
Names block_members_of(const std::vector<std::string_view>& code);

}  // namespace ballot
