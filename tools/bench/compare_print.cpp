#include <algorithm>

#include "tools/bench/compare.h"
#include "tools/bench/markdown.h"

namespace ballot::bench {

namespace {

constexpr std::size_t kNamed = 10;  // records that are named where there may be many

const char* verdict(const Ratio& r, double tolerance) {
  return r.slower(tolerance) ? "SLOWER" : r.faster(tolerance) ? "faster" : "";
}

std::string interval_text(const Ratio& r) { return fmt::format("{:.3f} to {:.3f}", r.low, r.high); }

void print_groups(const std::vector<Change>& groups, double tolerance) {
  std::string place;
  Table table({""});
  const auto flush = [&] {
    if (!table.empty()) fmt::print("{}", table.text());
  };
  for (const Change& c : groups) {
    const std::string here = fmt::format("{}, {}, {}", c.scene, c.rays, c.numeric);
    if (here != place) {
      flush();
      table = Table({here, "B / A", "95 % interval", "beyond noise"});
      place = here;
    }
    table.row({c.label, fmt::format("{:.3f}", c.time.ratio), interval_text(c.time), verdict(c.time, tolerance)});
  }
  flush();
}

std::string words(const Change& c) {
  return fmt::format("{}, {}{}, {}, {}: {:.3f} ({})", c.scene, c.view.empty() ? "" : c.view + ", ", c.rays, c.label,
                     c.numeric, c.time.ratio, interval_text(c.time));
}

/// Groups and single views that changed, the largest change first.
std::vector<Change> changed(const Comparison& comparison, bool slower, double tolerance) {
  std::vector<Change> list;
  for (const auto* all : {&comparison.groups, &comparison.records})
    for (const Change& c : *all) {
      if (all == &comparison.records && c.view.empty()) continue;  // foreign rays: a group of one, said already
      if (slower ? c.time.slower(tolerance) : c.time.faster(tolerance)) list.push_back(c);
    }
  std::ranges::stable_sort(list, {}, [&](const Change& c) { return slower ? -c.time.ratio : c.time.ratio; });
  return list;
}

void print_changed(const char* title, const std::vector<Change>& list) {
  fmt::print("{}: {}\n", title, list.empty() ? "none" : std::to_string(list.size()));
  for (const Change& c : list) fmt::print("  {}\n", words(c));
}

void print_missing(const char* where, const std::vector<std::string>& records) {
  if (records.empty()) return;
  fmt::print("only in {}: {} records\n", where, records.size());
  for (std::size_t i = 0; i < std::min(records.size(), kNamed); ++i) fmt::print("  {}\n", records[i]);
  if (records.size() > kNamed) fmt::print("  and {} more\n", records.size() - kNamed);
}

nlohmann::json changes_json(const std::vector<Change>& changes, double tolerance) {
  nlohmann::json list = nlohmann::json::array();
  for (const Change& c : changes)
    list.push_back({{"scene", c.scene},
                    {"view", c.view},
                    {"rays", c.rays},
                    {"label", c.label},
                    {"numeric", c.numeric},
                    {"ratio", c.time.ratio},
                    {"low", c.time.low},
                    {"high", c.time.high},
                    {"slower", c.time.slower(tolerance)},
                    {"faster", c.time.faster(tolerance)}});
  return list;
}

}  // namespace

bool print_comparison(const Comparison& comparison, double tolerance) {
  for (const std::string& warning : comparison.warnings) fmt::print(stderr, "ballot: warning: {}\n", warning);
  fmt::print("time per ray of the traversal in B over that in A; below 1 B is faster; geometric mean over views\n\n");
  print_groups(comparison.groups, tolerance);
  print_missing("A", comparison.only_a);
  print_missing("B", comparison.only_b);
  if (comparison.without_samples)
    fmt::print("{} records have fewer than two samples and were not judged\n", comparison.without_samples);
  const auto slower = changed(comparison, true, tolerance);
  print_changed(fmt::format("faster by more than {:g} %", 100 * tolerance).c_str(),
                changed(comparison, false, tolerance));
  print_changed(fmt::format("slower by more than {:g} %", 100 * tolerance).c_str(), slower);
  return !slower.empty();
}

nlohmann::json comparison_json(const Comparison& comparison, double tolerance) {
  return {{"tolerance", tolerance},
          {"groups", changes_json(comparison.groups, tolerance)},
          {"records", changes_json(comparison.records, tolerance)},
          {"only_a", comparison.only_a},
          {"only_b", comparison.only_b},
          {"warnings", comparison.warnings}};
}

}  // namespace ballot::bench
