// Lines of CSV by RFC 4180.
#pragma once

#include <string>
#include <vector>

#include "engine/ballot.h"

namespace ballot::bench {

/// Cells quoted where they must be, quotes doubled, with the end of the line.
std::string csv_line(const std::vector<std::string>& cells);
std::string csv_number(double value);  // nine significant digits at most
std::string knobs_text(const Knobs& knobs);

}  // namespace ballot::bench
