// Text for people: what the commands print. Data goes elsewhere (standard_output.h).
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <string_view>
#include <utility>

namespace ballot {

/// Prints a text on `to` as shown() makes it, so that names from files cannot steer the terminal. Throws Error(Work) if
/// standard output cannot take it, such as a full disk or a closed pipe; what standard error cannot take is lost.
void say_text(std::FILE* to, std::string_view text);

/// Prints a formatted text on standard output. Throws as say_text().
template <class... Args>
void say(fmt::format_string<Args...> text, Args&&... args) {
  say_text(stdout, fmt::format(text, std::forward<Args>(args)...));
}

/// Prints a formatted text on standard error.
template <class... Args>
void say_aside(fmt::format_string<Args...> text, Args&&... args) {
  say_text(stderr, fmt::format(text, std::forward<Args>(args)...));
}

/// Writes what standard output has buffered. Throws as say_text().
void flush_text();

}  // namespace ballot
