// The report of verified runs: verify.json, verify.csv, verify.md and a plot in a folder, or a section of a README.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/bench/document.h"

namespace ballot::verify {

/// True if `ballot verify` made the document.
bool is_verified(const bench::Document& document);

/// Makes the folder and checks that each file of a report can be written there. Throws Error(Work).
void check_report_folder(const std::filesystem::path& folder);
/// The files of a report beside its plot.
inline constexpr const char* kReportFiles[] = {"verify.json", "verify.csv", "verify.md"};

/// Writes the whole report. Returns the reason why there is no plot, "" if there is one. Throws Error(Work).
std::string write_report(const std::filesystem::path& folder, const std::vector<bench::Document>& documents);

/// Returns the main tables, for the README section "accuracy" (bench/readme.h).
std::string readme_text(const std::vector<bench::Document>& documents);

/// Returns the text of verify.csv: a line per record, quoted by RFC 4180. The scene of a hard case is "hard/CASE".
std::string csv_text(const std::vector<bench::Document>& documents);

}  // namespace ballot::verify
