#include "tools/bench/markdown.h"

#include <algorithm>
#include <cmath>

#include "engine/scene/device_scene.h"

namespace ballot::bench {

namespace {

/// Escapes '|' and replaces control characters. Names of scenes and views come from files and must not end a cell or a
/// line.
std::string cell_text(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    if (c == '|') safe += '\\';
    safe += static_cast<unsigned char>(c) < 32 ? ' ' : c;
  }
  return safe;
}

std::string line_of(const std::vector<std::string>& cells, const std::vector<std::size_t>& widths, std::size_t left) {
  std::string line = "|";
  for (std::size_t i = 0; i < cells.size(); ++i)
    line += i < left ? fmt::format(" {:<{}} |", cells[i], widths[i]) : fmt::format(" {:>{}} |", cells[i], widths[i]);
  return line + "\n";
}

}  // namespace

Table::Table(std::vector<std::string> header, std::size_t left) : left_(left) { row(std::move(header)); }

void Table::row(std::vector<std::string> cells) {
  for (std::string& cell : cells) cell = cell_text(cell);
  if (!rows_.empty()) cells.resize(rows_.front().size());
  rows_.push_back(std::move(cells));
}

std::string Table::text() const {
  std::vector<std::size_t> widths(rows_.front().size(), 3);
  for (const auto& cells : rows_)
    for (std::size_t i = 0; i < cells.size(); ++i) widths[i] = std::max(widths[i], cells[i].size());
  std::string text = line_of(rows_.front(), widths, left_) + "|";
  for (std::size_t i = 0; i < widths.size(); ++i)
    text += i < left_ ? fmt::format(" {:-<{}} |", "", widths[i]) : fmt::format(" {:-<{}}: |", "", widths[i] - 1);
  text += "\n";
  for (std::size_t i = 1; i < rows_.size(); ++i) text += line_of(rows_[i], widths, left_);
  return text + "\n";
}

std::string figure(double value) {
  if (value == 0) return "0";
  const double size = std::abs(value);
  const int digits = size >= 999.5 ? 0 : size >= 99.95 ? 1 : size >= 9.995 ? 2 : size >= 0.9995 ? 3 : 4;
  return fmt::format("{:.{}f}", value, digits);
}

}  // namespace ballot::bench
