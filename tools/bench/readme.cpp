#include "tools/bench/readme.h"

#include <algorithm>
#include <string_view>
#include <vector>

#include "engine/ballot.h"

namespace ballot::bench {

namespace {

namespace fs = std::filesystem;

std::string begin_of(const std::string& name) { return "<!-- " + name + ":begin -->"; }
std::string end_of(const std::string& name) { return "<!-- " + name + ":end -->"; }

/// Moves every heading one level down: the text goes below a heading of the file.
std::string one_level_down(const std::string& text) {
  std::string result;
  bool line_begins = true;
  for (const char c : text) {
    if (line_begins && c == '#') result += '#';
    result += c;
    line_begins = c == '\n';
  }
  return result;
}

/// Returns the position of the line that equals `marker`. Throws Error(Work) unless there is exactly one.
std::size_t marker_line(const std::string& text, const std::string& marker, const fs::path& file,
                        const std::string& name) {
  std::vector<std::size_t> found;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    std::string_view line(text.data() + begin, end - begin);
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (line == marker) found.push_back(begin);
    begin = end + 1;
  }
  if (found.size() != 1)
    fail(Failure::Work, "{}: found {} lines '{}', expected one; mark the place for the {} with '{}' and '{}'",
         file.string(), found.size(), marker, name, begin_of(name), end_of(name));
  return found.front();
}

struct Marked {
  std::string before, after;  // the text around the section, with the markers
};

Marked read_marked(const fs::path& file, const std::string& name) {
  const auto bytes = read_file(file);
  const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::size_t begin = marker_line(text, begin_of(name), file, name),
                    end = marker_line(text, end_of(name), file, name);
  if (end < begin)
    fail(Failure::Work, "{}: found '{}' before '{}', expected it after", file.string(), end_of(name), begin_of(name));
  return {text.substr(0, std::min(text.find('\n', begin) + 1, end)), text.substr(end)};
}

}  // namespace

void check_readme(const fs::path& file, const std::string& name) {
  read_marked(file, name);
  check_writable(file);
}

void write_readme(const fs::path& file, const std::string& name, const std::string& text) {
  const Marked marked = read_marked(file, name);
  write_file(file, marked.before + "\n" + one_level_down(text) + marked.after);
}

}  // namespace ballot::bench
