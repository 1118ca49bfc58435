// Tables and sentences of `ballot verify`, as text or Markdown.
#pragma once

#include <string>
#include <vector>

#include "tools/verify/pool.h"

namespace ballot::verify {

/// Each entry and mode of a place: speed, counts of what is wrong, errors of t.
std::string place_table(const Place& place);

/// Each hard case by numeric mode: of the entries the one with most wrong answers. "" without hard cases.
std::string hard_table(const std::vector<bench::HardRecord>& records);
/// A row a case, a column a mode.
std::string hard_summary(const std::vector<bench::HardRecord>& records);
/// What each case is, and who reported it.
std::string hard_list(const std::vector<bench::HardRecord>& records);

/// "watertight: 3 of 5.2 million answers wrong (0.58 per million), none beyond its bound; plain: ..."
std::string verdict(const bench::Document& document);

/// Of one mode: what it costs, how often it errs; platforms side by side.
std::string mode_table(const std::vector<Platform>& platforms);

/// Wrong answers per million by scene and ray kind, of the worst entry; modes and platforms side by side.
std::string rate_table(const std::vector<Platform>& platforms);

/// Wrong answers by place and mode, each with its reason, at most `most` of the entry that errs most, or in hard cases of
/// the first one that errs; "" if there are none.
std::string case_list(const std::vector<Platform>& platforms, const std::vector<bench::Document>& documents,
                      std::size_t most);

/// "5.2 million", "12 thousand", "640".
std::string count_text(std::uint64_t n);
/// Three digits or so: "0", "0.58", "12.3", "5210".
std::string rate_text(double rate);

}  // namespace ballot::verify
