#include <algorithm>

#include "tools/bench/compare.h"
#include "tools/bench/markdown.h"

namespace ballot::bench {

namespace {

constexpr std::size_t kNamed = 10;  // records that a long list names

const char* verdict(const Change& c, double tolerance) {
  if (!c.judged()) return "too few samples";
  return c.slower(tolerance) ? "SLOWER" : c.faster(tolerance) ? "faster" : "";
}

std::string interval_text(const Change& c) {
  return c.samples < 2 ? "-" : fmt::format("{:.3f} to {:.3f}", c.time.low, c.time.high);
}

void print_groups(const Comparison& comparison, double tolerance) {
  std::string place;
  Table table({""});
  const auto flush = [&] {
    if (!table.empty()) say("{}", table.text());
  };
  for (const Change& c : comparison.groups) {
    const std::string here =
        fmt::format("{}{}, {}, {}", comparison.several_settings ? c.setting + ": " : "", c.scene, c.rays, c.numeric);
    if (here != place) {
      flush();
      table = Table({here, "B / A", "interval", "beyond noise"});
      place = here;
    }
    table.row({c.label, fmt::format("{:.3f}", c.time.ratio), interval_text(c), verdict(c, tolerance)});
  }
  flush();
}

std::string words(const Change& c, bool with_setting) {
  return fmt::format("{}{}, {}{}, {}, {}: {:.3f} ({})", with_setting ? c.setting + ": " : "", c.scene,
                     c.view.empty() ? "" : c.view + ", ", c.rays, c.label, c.numeric, c.time.ratio, interval_text(c));
}

/// Returns the changes that are slower, or faster, than the tolerance allows; the largest first.
std::vector<Change> changed(const std::vector<Change>& all, bool slower, double tolerance) {
  std::vector<Change> list;
  for (const Change& c : all)
    if (slower ? c.slower(tolerance) : c.faster(tolerance)) list.push_back(c);
  std::ranges::stable_sort(list, {}, [&](const Change& c) { return slower ? -c.time.ratio : c.time.ratio; });
  return list;
}

void print_changed(const std::string& title, const std::vector<Change>& list, std::size_t most, bool with_setting) {
  say("{}: {}\n", title, list.empty() ? "none" : std::to_string(list.size()));
  for (std::size_t i = 0; i < std::min(list.size(), most); ++i) say("  {}\n", words(list[i], with_setting));
  if (list.size() > most) say("  and {} more\n", list.size() - most);
}

void print_missing(const char* where, const std::vector<std::string>& records) {
  if (records.empty()) return;
  say("only in {}: {} records\n", where, records.size());
  for (std::size_t i = 0; i < std::min(records.size(), kNamed); ++i) say("  {}\n", records[i]);
  if (records.size() > kNamed) say("  and {} more\n", records.size() - kNamed);
}

nlohmann::json changes_json(const std::vector<Change>& changes, double tolerance) {
  nlohmann::json list = nlohmann::json::array();
  for (const Change& c : changes)
    list.push_back({{"setting", c.setting},
                    {"scene", c.scene},
                    {"view", c.view},
                    {"rays", c.rays},
                    {"label", c.label},
                    {"numeric", c.numeric},
                    {"ratio", c.time.ratio},
                    {"low", c.time.low},
                    {"high", c.time.high},
                    {"samples", c.samples},
                    {"judged", c.judged()},
                    {"slower", c.slower(tolerance)},
                    {"faster", c.faster(tolerance)}});
  return list;
}

}  // namespace

bool print_comparison(const Comparison& comparison, double tolerance) {
  for (const std::string& warning : comparison.warnings) say_aside("ballot: warning: {}\n", warning);
  const bool named = comparison.several_settings;
  const auto judged = std::ranges::count_if(comparison.groups, [](const Change& c) { return c.judged(); });
  say("B / A: traversal time per ray in B over that in A, geometric mean over views; below 1, B is faster\n");
  say("interval: each one has a confidence of {:.4g} %, so that all {} hold together with 95 %\n\n",
      100 * comparison.confidence, judged);
  print_groups(comparison, tolerance);
  for (const std::string& note : comparison.notes) say("note: {}\n", note);
  print_missing("A", comparison.only_a);
  print_missing("B", comparison.only_b);
  if (const std::size_t others = comparison.groups.size() - std::size_t(judged))
    say("{} groups have too few samples and were not judged: some record has fewer than {}\n", others, kLeastSamples);
  const std::string beyond = fmt::format("by more than {:g} %", 100 * tolerance);
  const auto slower = changed(comparison.groups, true, tolerance);
  for (const bool worse : {false, true})
    print_changed(
        fmt::format("single views {} {}, for information, with 95 % each", worse ? "slower" : "faster", beyond),
        changed(comparison.records, worse, tolerance), kNamed, named);
  print_changed("faster " + beyond, changed(comparison.groups, false, tolerance), comparison.groups.size(), named);
  print_changed("slower " + beyond, slower, slower.size(), named);
  return !slower.empty();
}

nlohmann::json comparison_json(const Comparison& comparison, double tolerance) {
  return {{"tolerance", tolerance},
          {"confidence", comparison.confidence},
          {"groups", changes_json(comparison.groups, tolerance)},
          {"records", changes_json(comparison.records, tolerance)},
          {"only_a", comparison.only_a},
          {"only_b", comparison.only_b},
          {"warnings", comparison.warnings},
          {"notes", comparison.notes}};
}

}  // namespace ballot::bench
