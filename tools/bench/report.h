// A report of what was measured: results.json, records.csv, report.md and plots in a folder, or a part of a README.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/bench/arrange.h"

namespace ballot::bench {

/// Makes the folder and checks that each file of a report could be written there. Throws Error(Work).
void check_report_folder(const std::filesystem::path& folder);

/// Writes all of it; a figure that cannot be drawn for lack of matplotlib is a line in report.md, not an error.
/// Returns that line, "" if the plots were drawn. Throws Error(Work).
std::string write_report(const std::filesystem::path& folder, const std::vector<Document>& documents);

/// The main tables and answers, for the place in a README that is called "results" (readme.h).
std::string readme_text(const std::vector<Document>& documents);

// The sections, each Markdown under a heading of its own; "" where there is nothing to say.
std::string runs_text(const std::vector<Document>& documents);  // without a heading: a paragraph and a command each
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
std::string answer_section(const Setting& setting, bool brief = false);  // brief: votes of packet and cut only

/// What a short table shows: of each method the first vote that was measured, with a fixed and with the best threshold; of
/// packet and cut every vote.
bool is_main(const Block& block, const Cell& cell);

/// records.csv: a line per record, quoted by RFC 4180.
std::string csv_text(const std::vector<Document>& documents);

}  // namespace ballot::bench
