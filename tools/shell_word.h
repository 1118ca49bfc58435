// Words as a shell reads them.
#pragma once

#include <string>

namespace ballot {

/// The word itself where a shell takes it as it is, else in quotes.
inline std::string shell_word(const std::string& word) {
  if (!word.empty() && word.find_first_of(" \t\n\"'\\$`*?()<>|&;!#~[]{}") == std::string::npos) return word;
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

}  // namespace ballot
