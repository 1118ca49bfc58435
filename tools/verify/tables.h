// What `ballot verify` prints beside the table of each scene and kind of rays.
#pragma once

#include <string>
#include <vector>

#include "tools/bench/document.h"

namespace ballot::verify {

/// Returns a table with a row for each hard case and numeric mode: the entry that breaks the most promises or, if
/// equal, errs most. "" if there are no hard cases.
std::string hard_table(const std::vector<bench::HardRecord>& records);

/// Returns a sentence on each mode, such as "watertight: 3 of 5200000 answers wrong (0.58 per million), none beyond
/// its bound; plain: ...".
std::string verdict(const bench::Document& document);

}  // namespace ballot::verify
