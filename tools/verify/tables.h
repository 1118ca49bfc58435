// The tables and sentences of `ballot verify`, as text or Markdown.
#pragma once

#include <string>
#include <vector>

#include "tools/verify/pool.h"

namespace ballot::verify {

/// Returns a table with a row for each entry and mode of a place: speed, counts of wrong answers, errors of t.
std::string place_table(const Place& place);

/// Returns a table with a row for each hard case and numeric mode: the entry that breaks the most promises or, if
/// equal, errs most. "" if there are no hard cases.
std::string hard_table(const std::vector<bench::HardRecord>& records);
/// Returns a table with a row for each hard case and a column for each mode.
std::string hard_summary(const std::vector<bench::HardRecord>& records);
/// Returns a list that describes each case and names its source.
std::string hard_list(const std::vector<bench::HardRecord>& records);

/// Returns a sentence on each mode, such as "watertight: 3 of 5.2 million answers wrong (0.58 per million), none beyond
/// its bound; plain: ...".
std::string verdict(const bench::Document& document);

/// Returns a table with a row for each mode and platform: its cost and error rates.
std::string mode_table(const std::vector<Platform>& platforms);

/// Returns a table of wrong answers per million by scene and ray kind, those of the worst entry; modes and platforms
/// side by side.
std::string rate_table(const std::vector<Platform>& platforms);

/// Returns a list of wrong answers by place and mode, each with its reason. A place and mode shows at most `most`
/// answers: of the entry that errs most, in hard cases of the first that errs. "" if there are none.
std::string case_list(const std::vector<Platform>& platforms, const std::vector<bench::Document>& documents,
                      std::size_t most);

/// Returns a count in words if it is large: "5.2 million", "640".
std::string count_text(std::uint64_t n);
/// Returns a rate with at most two decimals, or with an exponent: "0", "0.58", "12.3", "5210", "1.2e-03".
std::string rate_text(double rate);

}  // namespace ballot::verify
