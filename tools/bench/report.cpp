#include "tools/bench/report.h"

#include <algorithm>

#include "tools/bench/plots.h"

namespace ballot::bench {

namespace {

namespace fs = std::filesystem;

/// Returns the sections for a README: the main entries only, with the settings side by side.
std::string readme_sections(const std::vector<Document>& documents, const Arranged& arranged) {
  std::string text = setup_section(documents, arranged);
  for (const Setting& s : arranged.settings) text += answer_section(s, true);
  return text + scene_section(documents) + frame_summary(arranged) + regret_overview(arranged);
}

/// Returns the first sections of a report: setup, answers and the main tables.
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

}  // namespace

void check_report_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) fail(Failure::Work, "--report {}: cannot create the folder: {}", folder.string(), error.message());
  for (const char* file : kReportFiles) check_writable(folder / file);
}

std::string write_report(const fs::path& folder, const std::vector<Document>& documents) {
  check_report_folder(folder);
  write_file(folder / "results.json", json_text(to_json(documents)), Links::Replace);
  write_file(folder / "records.csv", csv_text(documents), Links::Replace);
  const Arranged arranged = arrange(documents);
  const std::string main = "# Traversal methods, measured\n\n" + main_sections(documents, arranged);
  const std::string details = detail_sections(arranged);
  write_file(folder / "report.md", main + details, Links::Replace);  // the tables are there even if drawing fails
  const Plots plots = draw_plots(folder);
  write_file(folder / "report.md", main + plot_section(plots) + details, Links::Replace);
  return plots.missing;
}

std::string readme_text(const std::vector<Document>& documents) {
  return readme_sections(documents, arrange(documents));
}

}  // namespace ballot::bench
