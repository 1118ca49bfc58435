#include "tools/view/script.h"

#include <charconv>
#include <cmath>
#include <sstream>

#include "tools/view/glfw.h"

namespace ballot::view {

namespace {

struct Command {
  std::string_view name, words;
  std::size_t least, most;
};

constexpr Command kCommands[] = {
    {"wait", "N | SECONDSs | refined", 1, 1},
    {"key", "KEY [SECONDSs]", 1, 2},
    {"mouse", "DX DY", 2, 2},
    {"method", "NAME", 1, 1},
    {"numeric", "NAME", 1, 1},
    {"rays", "NAME", 1, 1},
    {"shading", "NAME", 1, 1},
    {"heat", "NAME", 1, 1},
    {"compare", "METHOD", 1, 1},
    {"view", "NAME", 1, 1},
    {"time", "SECONDS", 1, 1},
    {"pick", "X Y", 2, 2},
    {"resize", "WIDTHxHEIGHT", 1, 1},
    {"shot", "FILE.exr", 1, 1},
    {"times", "", 0, 0},
    {"quit", "", 0, 0},
};

[[noreturn]] void bad(const ScriptLine& line, const std::string& what) {
  fail(Failure::Arguments, "--script, line {}: {}; commands are:{}", line.number, what, script_help());
}

}  // namespace

std::string script_help() {
  std::string text;
  for (const Command& c : kCommands) text += fmt::format("\n  {} {}", c.name, c.words);
  return text;
}

std::vector<ScriptLine> parse_script(const std::string& text, const std::string& name) {
  std::vector<ScriptLine> lines;
  const bool cr_alone = text.find('\n') == std::string::npos;
  std::istringstream in(text);
  std::size_t number = 0;
  for (std::string line; std::getline(in, line, cr_alone ? '\r' : '\n');) {
    ScriptLine parsed{++number, {}};
    std::istringstream words(line.substr(0, line.find('#')));
    for (std::string word; words >> word;) parsed.words.push_back(word);
    if (parsed.words.empty()) continue;
    const Command* found = nullptr;
    for (const Command& c : kCommands)
      if (c.name == parsed.words[0]) found = &c;
    if (!found) bad(parsed, fmt::format("there is no command '{}' ({})", parsed.words[0], name));
    const std::size_t count = parsed.words.size() - 1;
    if (count < found->least || count > found->most)
      bad(parsed, fmt::format("{} takes: {}", found->name, found->words));
    if (found->name == "shot" && std::filesystem::path(parsed.words[1]).extension() != ".exr")
      bad(parsed,
          fmt::format("shot {}: pictures are EXR files; name a FILE.exr, a PNG is written beside it", parsed.words[1]));
    lines.push_back(std::move(parsed));
  }
  return lines;
}

std::vector<ScriptLine> read_script(const std::filesystem::path& path) {
  const auto bytes = read_argument(path);
  const std::string_view text = without_mark(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  return parse_script(std::string(text), path.string());
}

double duration_of(const ScriptLine& line, const std::string& word) {
  double value = 0;
  const char* end = word.data() + word.size();
  const auto result = std::from_chars(word.data(), end, value);
  const bool seconds = result.ptr + 1 == end && *result.ptr == 's';
  if (result.ec != std::errc() || !(value >= 0) || (!seconds && result.ptr != end))
    bad(line, fmt::format("'{}' is neither a number of frames, such as 10, nor a time, such as 0.5s", word));
  return seconds ? value : -value;
}

double number_of(const ScriptLine& line, const std::string& word) {
  double value = 0;
  const auto result = std::from_chars(word.data(), word.data() + word.size(), value);
  if (result.ec != std::errc() || result.ptr != word.data() + word.size() || !(std::abs(value) < 1e6))
    bad(line, fmt::format("'{}' is not a number, such as 12", word));
  return value;
}

int key_of(const ScriptLine& line, const std::string& word) {
  if (word.size() == 1 && word[0] >= 'a' && word[0] <= 'z') return word[0] - 'a' + GLFW_KEY_A;
  if (word.size() == 1 && ((word[0] >= 'A' && word[0] <= 'Z') || (word[0] >= '0' && word[0] <= '9'))) return word[0];
  if (word == "TAB") return GLFW_KEY_TAB;
  int number = 0;
  if (word.size() > 1 && word[0] == 'F' &&
      std::from_chars(word.data() + 1, word.data() + word.size(), number).ec == std::errc() && number >= 1 &&
      number <= 12)
    return GLFW_KEY_F1 + number - 1;
  bad(line, fmt::format("there is no key '{}'; the keys are A to Z, 0 to 9, F1 to F12, TAB", word));
}

}  // namespace ballot::view
