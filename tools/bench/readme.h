// A part of a text file that the program writes: what stands between two marker lines.
#pragma once

#include <filesystem>
#include <string>

namespace ballot::bench {

/// Checks that the file holds the lines <!-- name:begin --> and <!-- name:end --> once each, in this order, and can be
/// written. Throws Error(Work).
void check_readme(const std::filesystem::path& file, const std::string& name);

/// Replaces what stands between these lines; headings of the text go one level down. Throws as check_readme does.
void write_readme(const std::filesystem::path& file, const std::string& name, const std::string& text);

}  // namespace ballot::bench
