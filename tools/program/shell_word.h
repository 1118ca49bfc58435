// Quoting of words for a shell.
#pragma once

#include <string>

namespace ballot {

/// Returns the word unchanged if a shell would read it literally, else in single quotes.
inline std::string shell_word(const std::string& word) {
  if (!word.empty() && word.find_first_of(" \t\n\"'\\$`*?()<>|&;!#~[]{}") == std::string::npos) return word;
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

}  // namespace ballot
