// CSV lines by RFC 4180.
#pragma once

#include <string>
#include <vector>

#include "engine/ballot.h"

namespace ballot::bench {

/// Returns the cells as a line with its CRLF. Cells are quoted where RFC 4180 demands it, and quotes in them doubled.
std::string csv_line(const std::vector<std::string>& cells);
std::string csv_number(double value);  // with at most nine significant digits
std::string knobs_text(const Knobs& knobs);

}  // namespace ballot::bench
