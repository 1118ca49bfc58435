#include "tools/bench/regret.h"

#include <algorithm>

#include "tools/bench/markdown.h"
#include "tools/bench/plan.h"
#include "tools/bench/report.h"

namespace ballot::bench {

namespace {

/// Returns the regrets in a block by label. Entries that lack views, as after an interruption, are left out.
std::map<std::string, double> regret_in(const Block& block) {
  std::map<std::string, double> times;
  double best = 0;
  for (const Cell& cell : block.cells)
    if (block.whole(cell)) {
      const double ms = times[cell.label] = cell.total_ms();
      best = best == 0 ? ms : std::min(best, ms);
    }
  for (auto& [label, time] : times) time /= best;
  return times;
}

Role role_of(const Setting& setting, const std::string& label) {
  for (const Block& block : setting.blocks)
    if (const Cell* cell = block.find(label)) return cell->role;
  return Role::Method;
}

std::string regret_figure(double over_best) {
  const std::string text = fmt::format("{:.2f}", over_best);
  return over_best == 1 ? bold(text) : text;
}

}  // namespace

std::vector<Regret> regrets_of(const Setting& setting) {
  std::vector<Regret> all;
  std::map<const Block*, std::map<std::string, double>> by_block;
  for (const Block& block : setting.blocks) by_block[&block] = regret_in(block);
  for (const std::string& label : setting.labels()) {
    Regret regret;
    regret.label = label;
    regret.role = role_of(setting, label);
    std::vector<double> values;
    for (const Block& block : setting.blocks) {
      const auto found = by_block[&block].find(label);
      if (found == by_block[&block].end()) continue;
      regret.over_best[&block] = found->second;
      values.push_back(found->second);
      if (found->second > regret.max) {
        regret.max = found->second;
        regret.worst = &block;
      }
    }
    if (values.empty()) continue;
    regret.median = quantile(values, 0.5);
    regret.everywhere = values.size() == setting.blocks.size();
    all.push_back(std::move(regret));
  }
  return all;
}

std::string regret_summary(const Setting& setting) {
  std::vector<Regret> regrets = regrets_of(setting);
  if (regrets.size() < 2) return "";
  std::ranges::stable_sort(regrets, {}, [](const Regret& r) { return std::pair(!r.everywhere, r.max); });
  Table table({"method", "at most", "where", "median", "scenes x ray kinds"});
  for (const Regret& r : regrets)
    table.row({r.label, fmt::format("{:.2f}", r.max), r.worst->scene + ", " + r.worst->rays,
               fmt::format("{:.2f}", r.median), std::to_string(r.over_best.size())});
  return "## Time over the best method's: " + setting.name + "\n\n" + table.text();
}

std::string regret_overview(const Arranged& arranged) {
  std::vector<std::string> header{"time over the best method's: at most, median"}, labels;
  std::vector<std::vector<Regret>> all;
  for (const Setting& setting : arranged.settings) {
    header.push_back(setting.name);
    all.push_back(regrets_of(setting));
    for (const Block& block : setting.blocks)
      for (const Cell& cell : block.cells)
        if (is_main(block, cell) && std::ranges::find(labels, cell.label) == labels.end()) labels.push_back(cell.label);
  }
  const auto figures = [](const std::vector<Regret>& regrets, const std::string& label) -> std::string {
    const auto found = std::ranges::find(regrets, label, &Regret::label);
    return found == regrets.end() ? "" : fmt::format("{:.2f}, {:.2f}", found->max, found->median);
  };
  const auto stands_in = [&](const std::vector<Regret>& regrets, const std::string& label) {
    return std::ranges::any_of(labels, [&](const std::string& other) {
      return label_by_count(other) == label && figures(regrets, other).empty();
    });
  };
  Table table(header);
  bool stood_in = false;
  for (const std::string& label : labels) {
    std::vector<std::string> cells{label};
    bool some = false;
    for (const auto& regrets : all) {
      std::string text = figures(regrets, label);
      if (!text.empty() && stands_in(regrets, label)) {
        cells.emplace_back("above");
        continue;
      }
      if (text.empty() && !label_by_count(label).empty()) {
        text = figures(regrets, label_by_count(label));
        stood_in |= !text.empty();
      }
      some |= !text.empty();
      cells.push_back(text.empty() ? "-" : text);
    }
    if (some) table.row(std::move(cells));
  }
  if (table.empty()) return "";
  return "## How far from the best\n\nTime of each method over that of the fastest one, over all scenes and ray kinds "
         "measured." +
         std::string(stood_in ? " Where votes by `any` were not measured, those by `count` stand in." : "") + "\n\n" +
         table.text();
}

std::string regret_section(const Setting& setting) {
  const std::vector<Regret> regrets = regrets_of(setting);
  if (regrets.size() < 2) return "";
  std::string text = "## Time over the best method's, by ray kind: " + setting.name + "\n\n";
  for (const std::string& rays : setting.ray_kinds()) {
    std::vector<std::string> header{rays};
    for (const Block& block : setting.blocks)
      if (block.rays == rays) header.push_back(block.scene);
    Table table(header);
    for (const Regret& r : regrets) {
      std::vector<std::string> cells{r.label};
      bool any = false;
      for (const Block& block : setting.blocks) {
        if (block.rays != rays) continue;
        const auto found = r.over_best.find(&block);
        any |= found != r.over_best.end();
        cells.push_back(found == r.over_best.end() ? "-" : regret_figure(found->second));
      }
      if (any) table.row(std::move(cells));
    }
    text += table.text();
  }
  return text;
}

}  // namespace ballot::bench
