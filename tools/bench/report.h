// The report of measured runs: results.json, records.csv, report.md and plots in a folder, or a section of a README.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/bench/arrange.h"

namespace ballot::bench {

/// Makes the folder and checks that each file of a report can be written there. Throws Error(Work).
void check_report_folder(const std::filesystem::path& folder);
/// The files of a report beside its plots.
inline constexpr const char* kReportFiles[] = {"results.json", "records.csv", "report.md"};

/// Writes the whole report. If matplotlib is missing, that is no error: report.md gets a line that says so. Returns
/// that line, "" if the plots were drawn. Throws Error(Work).
std::string write_report(const std::filesystem::path& folder, const std::vector<Document>& documents);

/// Returns the main tables and answers, for the README section "results" (readme.h).
std::string readme_text(const std::vector<Document>& documents);

// The sections. Each is Markdown under its own heading, or "" if it has no content.
std::string runs_text(const std::vector<Document>& documents);  // no heading: a paragraph and a command for each run
std::string setup_section(const std::vector<Document>& documents, const Arranged& arranged);
std::string scene_section(const std::vector<Document>& documents);  // Table 1
std::string frame_section(const Setting& setting);                  // Table 2
std::string frame_summary(const Arranged& arranged);                // Table 2 with all settings side by side
std::string speed_section(const Setting& setting);
std::string vote_section(const Setting& setting);
std::string regret_summary(const Setting& setting);
std::string regret_overview(const Arranged& arranged);  // all settings side by side
std::string regret_section(const Setting& setting);
std::string sweep_section(const Setting& setting);
std::string counter_section(const Setting& setting);
std::string check_section(const Setting& setting);
std::string answer_section(const Setting& setting, bool brief = false);  // brief: only votes of packet and cut

/// True if a short table shows the cell. It shows the first measured vote of each method, with a fixed and with the
/// best threshold, and every vote of packet and cut.
bool is_main(const Block& block, const Cell& cell);

/// Returns the text of records.csv: a line per record, quoted by RFC 4180.
std::string csv_text(const std::vector<Document>& documents);

}  // namespace ballot::bench
