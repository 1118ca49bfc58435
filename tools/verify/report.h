// A report of verified runs: verify.json, verify.csv, verify.md and a plot in a folder, or a part of a README.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "tools/bench/document.h"

namespace ballot::verify {

/// Whether `ballot verify` made it.
bool is_verified(const bench::Document& document);

/// Makes the folder and checks that each file of a report could be written there. Throws Error(Work).
void check_report_folder(const std::filesystem::path& folder);

/// Writes all of it. Returns why there is no plot, "" if it was drawn. Throws Error(Work).
std::string write_report(const std::filesystem::path& folder, const std::vector<bench::Document>& documents);

/// The main tables, for the place in a README that is called "accuracy" (bench/readme.h).
std::string readme_text(const std::vector<bench::Document>& documents);

/// verify.csv: a line per record, hard cases with scene "hard/CASE", quoted by RFC 4180.
std::string csv_text(const std::vector<bench::Document>& documents);

}  // namespace ballot::verify
