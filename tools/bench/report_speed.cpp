// The sections on the trace speed of every entry and on the cost of each vote.
#include <algorithm>

#include "tools/bench/markdown.h"
#include "tools/bench/report.h"
#include "tools/bench/votes.h"

namespace ballot::bench {

namespace {

std::string speed_table(const Setting& setting, const std::string& rays) {
  std::vector<const Block*> blocks;
  std::vector<std::string> header{rays};
  std::vector<double> best;
  for (const Block& block : setting.blocks) {
    if (block.rays != rays || block.cells.empty()) continue;
    blocks.push_back(&block);
    header.push_back(block.scene);
    double most = 0;
    for (const Cell& cell : block.cells)
      if (block.whole(cell)) most = std::max(most, cell.mrays_per_s());
    best.push_back(most);
  }
  Table table(header);
  for (const std::string& label : setting.labels()) {
    std::vector<std::string> cells{label};
    bool some = false;
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      const Cell* cell = blocks[i]->find(label);
      some |= cell != nullptr;
      const double speed = cell ? cell->mrays_per_s() : 0;
      cells.push_back(!cell ? "-" : speed == best[i] && blocks[i]->whole(*cell) ? bold(figure(speed)) : figure(speed));
    }
    if (some) table.row(std::move(cells));
  }
  return table.empty() ? "" : table.text();
}

/// Returns the geometric mean over scenes with the range, such as "1.120 (1.03 to 1.20)".
std::string spread(const std::vector<double>& ratios) {
  if (ratios.empty()) return "-";
  const auto [least, most] = std::ranges::minmax(ratios);
  const double mean = geometric_mean(ratios);
  if (ratios.size() == 1) return fmt::format("{:.3f}", mean);
  return fmt::format("{:.3f} ({:.2f} to {:.2f})", mean, least, most);
}

}  // namespace

std::string speed_section(const Setting& setting) {
  std::string tables;
  for (const std::string& rays : setting.ray_kinds()) tables += speed_table(setting, rays);
  if (tables.empty()) return "";
  return "## Mrays/s, trace alone: " + setting.name + "\n\n" + tables;
}

std::string vote_section(const Setting& setting) {
  const std::vector<VotePair> pairs = vote_pairs(setting);
  Table table({"method", "rays", "count / any", "sum / any", "count / sum"}, 2);
  std::vector<std::pair<std::string, std::string>> rows;
  for (const VotePair& pair : pairs)
    if (std::ranges::find(rows, std::pair(pair.method, pair.block->rays)) == rows.end())
      rows.emplace_back(pair.method, pair.block->rays);
  for (const auto& [method, rays] : rows) {
    const auto ratios = [&](std::string_view vote, std::string_view base) {
      std::vector<double> all;
      for (const VotePair& pair : pairs)
        if (pair.method == method && pair.block->rays == rays && pair.vote == vote && pair.base == base)
          all.push_back(pair.speed);
      return spread(all);
    };
    table.row({method, rays, ratios("count", "any"), ratios("sum", "any"), ratios("count", "sum")});
  }
  if (table.empty()) return "";
  return "## Speed by vote: " + setting.name +
         "\n\nSpeed with the first vote over speed with the second: geometric mean over scenes, and in brackets the "
         "range. Above 1 the first vote is faster.\n\n" +
         table.text();
}

}  // namespace ballot::bench
