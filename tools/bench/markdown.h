// Tables and figures of a report as Markdown.
#pragma once

#include <string>
#include <vector>

namespace ballot::bench {

/// A table whose first `left` columns are texts; the others are figures, set flush right.
class Table {
 public:
  explicit Table(std::vector<std::string> header, std::size_t left = 1);
  void row(std::vector<std::string> cells);
  bool empty() const { return rows_.size() == 1; }
  std::string text() const;  // with columns aligned for reading as plain text, and an empty line at the end

 private:
  std::size_t left_;
  std::vector<std::vector<std::string>> rows_;  // the header first
};

/// Four significant digits or more: "5867", "36.84", "0.9931".
std::string figure(double value);
/// "+12.3 %" of a ratio of 1.123.
std::string percent(double ratio);
std::string bold(const std::string& text);

}  // namespace ballot::bench
