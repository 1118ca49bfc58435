#include "tools/bench/report.h"

#include <algorithm>

#include "tools/bench/plots.h"

namespace ballot::bench {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kBegin = "<!-- results:begin -->", kEnd = "<!-- results:end -->";

/// What a README shows: the same questions, with the settings side by side and the main entries only.
std::string readme_sections(const std::vector<Document>& documents, const Arranged& arranged) {
  std::string text = setup_section(documents, arranged);
  for (const Setting& s : arranged.settings) text += answer_section(s, true);
  return text + scene_section(documents) + frame_summary(arranged) + regret_overview(arranged);
}

/// What a report begins with.
std::string main_sections(const std::vector<Document>& documents, const Arranged& arranged) {
  std::string text = setup_section(documents, arranged);
  for (const Setting& s : arranged.settings) text += answer_section(s);
  text += scene_section(documents);
  for (const Setting& s : arranged.settings) text += frame_section(s);
  for (const Setting& s : arranged.settings) text += speed_section(s);
  for (const Setting& s : arranged.settings) text += regret_summary(s);
  return text;
}

std::string detail_sections(const Arranged& arranged) {
  std::string text;
  for (const auto section : {vote_section, regret_section, sweep_section, counter_section, check_section})
    for (const Setting& s : arranged.settings) text += section(s);
  return text;
}

std::string plot_section(const Plots& plots) {
  std::string text = "## Plots\n\n";
  for (const std::string& file : plots.files)
    text += fmt::format("![{}]({})\n\n", fs::path(file).stem().string(), file);
  if (!plots.missing.empty())
    text += plots.missing + "\n\n";
  else if (plots.files.empty())
    text += "Nothing to draw.\n\n";
  return text;
}

/// Headings one level down, as the text stands below a heading of the file that it goes into.
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

/// Where a line that is `marker` and nothing else begins. Throws unless there is exactly one.
std::size_t marker_line(const std::string& text, std::string_view marker, const fs::path& file) {
  std::vector<std::size_t> found;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    std::string_view line(text.data() + begin, end - begin);
    if (line.ends_with('\r')) line.remove_suffix(1);
    if (line == marker) found.push_back(begin);
    begin = end + 1;
  }
  if (found.size() != 1)
    fail(Failure::Work, "{}: found {} lines '{}', expected one; mark the place for the results with '{}' and '{}'",
         file.string(), found.size(), marker, kBegin, kEnd);
  return found.front();
}

struct Marked {
  std::string before, after;  // with the markers
};

Marked read_marked(const fs::path& file) {
  const auto bytes = read_file(file);
  const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const std::size_t begin = marker_line(text, kBegin, file), end = marker_line(text, kEnd, file);
  if (end < begin) fail(Failure::Work, "{}: found '{}' before '{}', expected it after", file.string(), kEnd, kBegin);
  return {text.substr(0, std::min(text.find('\n', begin) + 1, end)), text.substr(end)};
}

}  // namespace

void check_report_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) fail(Failure::Work, "--report {}: the folder cannot be made: {}", folder.string(), error.message());
  for (const char* file : {"results.json", "records.csv", "report.md"}) check_writable(folder / file);
}

std::string write_report(const fs::path& folder, const std::vector<Document>& documents) {
  check_report_folder(folder);
  write_file(folder / "results.json", to_json(documents).dump(1) + "\n");
  write_file(folder / "records.csv", csv_text(documents));
  const Arranged arranged = arrange(documents);
  const std::string main = "# Traversal methods, measured\n\n" + main_sections(documents, arranged);
  const std::string details = detail_sections(arranged);
  write_file(folder / "report.md", main + details);  // should drawing fail, the figures are there
  const Plots plots = draw_plots(folder);
  write_file(folder / "report.md", main + plot_section(plots) + details);
  return plots.missing;
}

void check_readme(const fs::path& file) {
  read_marked(file);
  check_writable(file);
}

void write_readme(const fs::path& file, const std::vector<Document>& documents) {
  const Marked marked = read_marked(file);
  write_file(file,
             marked.before + "\n" + one_level_down(readme_sections(documents, arrange(documents))) + marked.after);
}

}  // namespace ballot::bench
