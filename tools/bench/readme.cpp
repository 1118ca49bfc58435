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

/// Returns the positions of the lines that equal `marker`.
std::vector<std::size_t> marker_lines(const std::string& text, const std::string& marker) {
  std::vector<std::size_t> found;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    std::string_view line(text.data() + begin, end - begin);
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (line == marker) found.push_back(begin);
    begin = end + 1;
  }
  return found;
}

/// Returns the position of the line that equals `marker`. Throws Error(Work) unless there is exactly one.
std::size_t marker_line(const std::string& text, const std::string& marker, const fs::path& file,
                        const std::string& name) {
  const std::vector<std::size_t> found = marker_lines(text, marker);
  if (found.size() != 1)
    fail(Failure::Work, "{}: found {} lines '{}', expected one; mark the place for the {} with '{}' and '{}'",
         file.string(), found.size(), marker, name, begin_of(name), end_of(name));
  return found.front();
}

struct Marked {
  std::string before, after;  // the text around the section, with the markers
};

std::string read_text(const fs::path& file) {
  const auto bytes = read_file(file);
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

Marked read_marked(const fs::path& file, const std::string& name) {
  const std::string text = read_text(file);
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

std::vector<std::string> check_sections(const fs::path& file, std::span<const std::string> names) {
  const std::string text = read_text(file);
  std::vector<std::string> found;
  std::string known;
  for (const std::string& name : names) {
    known += fmt::format("{}'{}'", known.empty() ? "" : ", ", begin_of(name));
    if (!marker_lines(text, begin_of(name)).empty() || !marker_lines(text, end_of(name)).empty()) found.push_back(name);
  }
  if (found.empty())
    fail(Failure::Work, "{}: found no section to write, expected one of the lines {}, with its end", file.string(),
         known);
  for (const std::string& name : found) check_readme(file, name);
  return found;
}

void write_readme(const fs::path& file, const std::string& name, const std::string& text) {
  const Marked marked = read_marked(file, name);
  write_file(file, marked.before + "\n" + one_level_down(text) + marked.after);
}

}  // namespace ballot::bench
