// The section of a text file, such as a README, between two marker lines, which the program replaces.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace ballot::bench {

/// Checks that the file has each of the lines <!-- name:begin --> and <!-- name:end --> once, in this order, and can be
/// written. Throws Error(Work).
void check_readme(const std::filesystem::path& file, const std::string& name);

/// Returns those of these names whose lines the file has, and checks each as check_readme does. Throws Error(Work) if
/// the file has none of them.
std::vector<std::string> check_sections(const std::filesystem::path& file, std::span<const std::string> names);

/// Replaces the text between these lines. Headings of `text` move one level down. Throws as check_readme does.
void write_readme(const std::filesystem::path& file, const std::string& name, const std::string& text);

}  // namespace ballot::bench
