#include "tools/bench/csv.h"

namespace ballot::bench {

namespace {

/// Quotes a cell if RFC 4180 demands it, and doubles the quotes in it.
std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string result = "\"";
  for (const char c : text) result += c == '"' ? std::string("\"\"") : std::string(1, c);
  return result + "\"";
}

}  // namespace

std::string csv_line(const std::vector<std::string>& cells) {
  std::string line;
  for (const std::string& cell : cells) line += (line.empty() ? "" : ",") + quoted(cell);
  return line + "\r\n";
}

std::string csv_number(double value) { return fmt::format("{:.9g}", value); }

std::string knobs_text(const Knobs& knobs) {
  std::string text;
  for (const auto& [name, value] : knobs) text += (text.empty() ? "" : " ") + name + "=" + value;
  return text;
}

}  // namespace ballot::bench
