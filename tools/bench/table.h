// The table that `bench` and `verify` print: the entries on one scene and kind of rays.
#pragma once

#include <span>
#include <string>

#include "tools/bench/document.h"

namespace ballot::bench {

/// Returns a table with a row for each entry and numeric mode: speeds over all views, of which the fastest of each mode
/// is marked; of verified records the errors instead of frames. "" without records, sweeps aside.
std::string block_table(std::span<const Record> records);

}  // namespace ballot::bench
