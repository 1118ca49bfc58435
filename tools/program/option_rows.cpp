#include "tools/program/option_rows.h"

#include <algorithm>
#include <regex>

#include "generated/door_rows.h"

namespace ballot::cli {

namespace {

/// Returns the text of a row as help has it: the default in brackets.
std::string help_of(const door::Row& row) {
  std::string text = std::regex_replace(row.text, std::regex("[;.] NULL: \"([a-z]+)\""), " [$1]");
  text = std::regex_replace(text, std::regex("^1: "), "");
  constexpr std::size_t kWidth = 104;
  for (std::size_t begin = 0, end; text.size() - begin > kWidth; begin = end + 1) {
    end = text.rfind(' ', begin + kWidth);
    text[end] = '\n';
  }
  return text;
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
