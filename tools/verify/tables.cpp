#include "tools/verify/tables.h"

#include <algorithm>
#include <map>

#include "tools/bench/markdown.h"
#include "tools/verify/hard.h"

namespace ballot::verify {

namespace {

using bench::HardRecord;
using bench::wrong_of;

/// The sums over all sets of rays of one hard case, for one entry.
struct CaseSum {
  std::uint64_t leaks = 0, differing = 0, unlike = 0, broken = 0;
  ErrorFigures errors;

  std::uint64_t badness() const { return errors.errors() + leaks + differing + unlike; }
  void add(const HardRecord& r) {
    leaks += r.leaks;
    differing += r.differing;
    unlike += r.unlike;
    broken += broken_promises(r);
    bench::add(errors, r.errors);
  }
};

void add_row(bench::Table& table, const std::string& name, const std::string& mode,
             const std::map<std::string, CaseSum>& entries) {
  const auto& [label, s] = *std::ranges::max_element(
      entries, {}, [](const auto& entry) { return std::pair(entry.second.broken, entry.second.badness()); });
  const ErrorFigures& e = s.errors;
  std::vector<std::string> cells{name, mode, s.badness() == 0 ? "all equal" : label};
  for (const std::uint64_t n : {e.rays, s.leaks, e.false_misses, e.false_hits, e.wrong_prims, e.ties, e.wrong_values,
                                e.beyond_bound, s.unlike, s.differing, e.unwritten})
    cells.push_back(std::to_string(n));
  cells.push_back(s.broken ? "**broken**" : find_numeric(mode).conservative ? "kept" : "-");
  table.row(std::move(cells));
}

std::string sentence_of(const std::string& numeric, const ErrorFigures& e) {
  const std::string bound = find_numeric(numeric).conservative ? "its bound" : "the bound of its arithmetic";
  std::string text = numeric + ": ";
  if (wrong_of(e) == 0)
    text += fmt::format("none of {} answers wrong", e.rays);
  else
    text += fmt::format("{} of {} answers wrong ({:.3g} per million), {} beyond {}", wrong_of(e), e.rays,
                        1e6 * double(wrong_of(e)) / double(e.rays),
                        e.beyond_bound == 0 ? "none" : std::to_string(e.beyond_bound), bound);
  if (e.wrong_values > 0) text += fmt::format(", {} with t, u or v beyond the bound", e.wrong_values);
  if (e.ties > 0 && numeric == "exact") text += fmt::format(", {} ties not settled by number", e.ties);
  if (e.beyond_range > 0)
    text += fmt::format(", {} beyond its range (direction below 1.18e-38, or origin too far away)", e.beyond_range);
  if (e.unwritten > 0) text += fmt::format(", {} not written", e.unwritten);
  return text;
}

}  // namespace

std::string hard_table(const std::vector<HardRecord>& records) {
  bench::Table table({"hard case", "mode", "worst method", "rays", "leaks", "false misses", "false hits", "wrong prims",
                      "ties", "wrong values", "beyond bound", "unlike known", "differ", "unwritten", "promise"},
                     3);
  for (auto first = records.begin(); first != records.end();) {
    const auto last = std::ranges::find_if(first, records.end(), [&](const auto& r) { return r.name != first->name; });
    std::map<std::string, std::map<std::string, CaseSum>> sums;  // by mode and label
    for (const HardRecord& r : std::ranges::subrange(first, last)) {
      if (r.failed.empty())
        sums[r.numeric][r.label].add(r);
      else
        table.row({r.name, "", "failed: " + r.failed});
    }
    for (const NumericMode& mode : kNumericModes)
      if (const auto found = sums.find(std::string(mode.name)); found != sums.end())
        add_row(table, first->name, found->first, found->second);
    first = last;
  }
  return table.empty() ? "" : table.text();
}

std::string verdict(const bench::Document& document) {
  std::map<std::string, ErrorFigures> totals;  // over the answers of scenes and hard cases
  for (const bench::Record& r : document.records)
    if (r.errors) bench::add(totals[r.numeric], *r.errors);
  for (const HardRecord& r : document.hard)
    if (r.failed.empty()) bench::add(totals[r.numeric], r.errors);
  std::string text;
  for (const NumericMode& mode : kNumericModes)
    if (const auto found = totals.find(std::string(mode.name)); found != totals.end())
      text += (text.empty() ? "" : "; ") + sentence_of(found->first, found->second);
  return text.empty() ? "no answer was checked against the exact oracle" : text + ".";
}

}  // namespace ballot::verify
