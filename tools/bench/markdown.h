// Tables and numbers in a terminal.
#pragma once

#include <string>
#include <vector>

namespace ballot::bench {

/// A Markdown table. The first `left` columns hold text; the others hold numbers and are aligned right.
class Table {
 public:
  explicit Table(std::vector<std::string> header, std::size_t left = 1);
  void row(std::vector<std::string> cells);
  bool empty() const { return rows_.size() == 1; }
  std::string text() const;  // padded so that it also reads well as plain text; ends with an empty line

 private:
  std::size_t left_;
  std::vector<std::vector<std::string>> rows_;  // the header first
};

/// Returns a number with at least four significant digits: "5867", "36.84", "0.9931".
std::string figure(double value);

}  // namespace ballot::bench
