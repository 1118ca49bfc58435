#include "tools/program/help.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

namespace ballot::cli {

namespace {

constexpr const char* kMore = "More options";
constexpr std::size_t kNames = 27, kScreen = 100;  // columns: of the names of options, and of a line

/// Returns a paragraph with lines of at most `width` characters, unless a word is longer.
std::string wrapped(const std::string& text, std::size_t width) {
  std::istringstream words(text);
  std::string out;
  std::size_t used = 0;  // characters of the last line
  for (std::string word; words >> word;) {
    const bool fits = used + 1 + word.size() <= width;
    if (!out.empty()) out += fits ? ' ' : '\n';
    used = out.empty() || !fits ? word.size() : used + 1 + word.size();
    out += word;
  }
  return out;
}

/// Returns a description for the first level: its lines as a paragraph, and the names of its list.
std::string paragraph(const std::string& description) {
  std::istringstream lines(description);
  std::string text, names;
  for (std::string line; std::getline(lines, line);) {
    const std::size_t start = line.find_first_not_of(' ');
    if (start == 0) text += (text.empty() ? "" : " ") + line;
    if (start == 2) names += (names.empty() ? "" : ", ") + line.substr(2, line.find(' ', 2) - 2);
  }
  return names.empty() ? text : text + ": " + names;
}

class Levels : public CLI::Formatter {
 public:
  Levels() { column_width(kNames); }

  std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override {
    whole_ = mode != CLI::AppFormatMode::Normal;
    return CLI::Formatter::make_help(app, name, mode);
  }
  std::string make_group(std::string group, bool positional, std::vector<const CLI::Option*> options) const override {
    if (group == kMore && !whole_)
      return fmt::format("--help-all explains the names above and lists {} options more.\n", options.size());
    return CLI::Formatter::make_group(group, positional, options);
  }
  std::string make_option_desc(const CLI::Option* option) const override {
    const std::string text = option->get_description();
    return whole_ ? text : wrapped(paragraph(text), kScreen - kNames);
  }
  std::string make_subcommand(const CLI::App* sub) const override {
    std::ostringstream out;
    CLI::detail::format_help(out, sub->get_name(), wrapped(sub->get_description(), kScreen - kNames), kNames);
    return out.str();
  }
  std::string make_footer(const CLI::App* app) const override {
    const std::string footer = app->get_footer();
    return footer.empty() ? "" : footer + "\n";
  }

 private:
  mutable bool whole_ = false;
};

}  // namespace

void use_two_levels(CLI::App& app) {
  app.formatter(std::make_shared<Levels>());
  app.set_help_flag("-h,--help", "shows what one needs first");
  app.set_help_all_flag("--help-all", "shows every option, and what the names mean that options take");
}

void show_first(CLI::App& cmd, std::initializer_list<const char*> options) {
  for (CLI::Option* option : cmd.get_options())
    if (option->nonpositional() && option != cmd.get_help_ptr() && option != cmd.get_help_all_ptr())
      option->group(kMore);
  for (const char* name : options) cmd.get_option(name)->group("Options");
}

}  // namespace ballot::cli
