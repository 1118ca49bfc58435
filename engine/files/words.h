// Reads the words and numbers of text formats. Internal to engine/files.
#pragma once

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <string>
#include <string_view>

#include "engine/files/flaw.h"

namespace ballot {

/// A text of words that spaces and ends of lines part: LF, CR LF or CR. Numbers are those of std::from_chars.
class Words {
 public:
  explicit Words(std::string_view text, std::size_t first_line = 1) : rest_(text), line_(first_line) {}

  /// Returns the next word; empty at the end of the text.
  std::string_view next() {
    std::size_t begin = 0;
    for (char last = 0; begin < rest_.size() && is_space(rest_[begin]); last = rest_[begin++])
      line_ += rest_[begin] == '\r' || (rest_[begin] == '\n' && last != '\r');
    std::size_t end = begin;
    while (end < rest_.size() && !is_space(rest_[end])) ++end;
    const std::string_view word = rest_.substr(begin, end - begin);
    rest_.remove_prefix(end);
    return word;
  }

  /// Returns the next word as a number. Throws Flaw if it is none. `what` names its place.
  template <class T = float>
  T number(std::string_view what) {
    std::string_view word = next();
    if (word.empty()) fail("the file ends where a number of {} is expected", what);
    if (word.starts_with('+')) word.remove_prefix(1);
    T value{};
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    const bool whole = end == word.data() + word.size();
    if constexpr (std::is_floating_point_v<T>) {
      if (error == std::errc::result_out_of_range && whole) return T(std::strtod(std::string(word).c_str(), nullptr));
    }
    if (error != std::errc{} || !whole) fail("'{}' where a number of {} is expected", word.substr(0, 40), what);
    return value;
  }

  /// Returns what follows in the line.
  std::string_view rest_of_line() const { return rest_.substr(0, std::min(rest_.find_first_of("\r\n"), rest_.size())); }

  /// Moves to the next line.
  void skip_line() { rest_.remove_prefix(rest_of_line().size()); }

  /// Throws Flaw with the number of the line.
  template <class... Args>
  [[noreturn]] void fail(fmt::format_string<Args...> text, Args&&... args) const {
    throw Flaw(fmt::format(text, std::forward<Args>(args)...), line_);
  }

 private:
  static bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

  std::string_view rest_;
  std::size_t line_;
};

}  // namespace ballot
