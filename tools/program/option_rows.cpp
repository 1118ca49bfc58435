#include "tools/program/option_rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <regex>
#include <string_view>

#include "generated/door_rows.h"

namespace ballot::cli {

namespace {

/// Returns the text of a row as help has it: the default in brackets, and what follows the first sentence indented, as
/// --help leaves that out.
std::string help_of(const door::Row& row) {
  std::string text = std::regex_replace(row.text, std::regex("[;.] NULL: \"([a-z]+)\""), " [$1]");
  text = std::regex_replace(text, std::regex("^1: "), "");
  std::string help;
  const auto add = [&help](std::string_view words, const char* indent) {
    constexpr std::size_t kWidth = 102;
    while (!words.empty()) {
      const std::size_t end = words.size() <= kWidth ? words.size() : words.rfind(' ', kWidth);
      help += fmt::format("{}{}{}", help.empty() ? "" : "\n", indent, words.substr(0, end));
      words.remove_prefix(std::min(words.size(), end + 1));
    }
  };
  const std::size_t first = std::min(text.find(". "), text.size());
  add(std::string_view(text).substr(0, first), "");
  add(std::string_view(text).substr(std::min(text.size(), first + 2)), " ");
  return help;
}

}  // namespace

void OptionRows::add_to(CLI::App& cmd, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    const auto* row = std::ranges::find(door::kQueryRows, std::string_view(name), &door::Row::name);
    std::string option = "--" + std::string(name);
    std::ranges::replace(option, '_', '-');
    char* member = reinterpret_cast<char*>(&query_) + row->offset;
    const std::string help = help_of(*row);
    if (row->type == door::Type::Bool)
      cmd.add_flag(option, *reinterpret_cast<BallotBool*>(member), help);
    else if (row->type == door::Type::UInt32)
      cmd.add_option(option, *reinterpret_cast<std::uint32_t*>(member), help)->check(CLI::Range(1u, kAllHits - 1));
    else
      cmd.add_option_function<std::string>(
          option,
          [this, member](const std::string& text) {
            *reinterpret_cast<BallotText*>(member) = texts_.emplace_back(text).c_str();
          },
          help);
  }
}

}  // namespace ballot::cli
