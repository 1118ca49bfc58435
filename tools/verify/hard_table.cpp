// The tables of the hard cases.
#include <algorithm>

#include "tools/bench/markdown.h"
#include "tools/verify/hard.h"
#include "tools/verify/tables.h"

namespace ballot::verify {

namespace {

using bench::HardRecord;

/// The sums over all sets of rays of one case, for one entry and numeric mode.
struct CaseSum {
  std::string label, numeric;
  std::uint64_t leaks = 0, differing = 0, unlike = 0, broken = 0;
  bench::Accuracy accuracy;

  std::uint64_t badness() const { return accuracy.wrong() + accuracy.wrong_values + leaks + differing + unlike; }
  void add(const HardRecord& r) {
    leaks += r.leaks;
    differing += r.differing;
    unlike += r.unlike;
    broken += broken_promises(r);
    accuracy.add(r.accuracy);
  }
};

struct Case {
  std::string name, from, what, failed;
  std::vector<CaseSum> sums;

  /// Returns the entry of a mode with the most wrong answers; null if there is none.
  const CaseSum* worst(const std::string& numeric) const {
    const CaseSum* found = nullptr;
    for (const CaseSum& s : sums)
      if (s.numeric == numeric &&
          (!found || std::pair(s.broken, s.badness()) > std::pair(found->broken, found->badness())))
        found = &s;
    return found;
  }
};

std::vector<Case> cases_of(const std::vector<HardRecord>& records) {
  std::vector<Case> cases;
  for (const HardRecord& r : records) {
    auto found = std::ranges::find(cases, r.name, &Case::name);
    if (found == cases.end()) found = cases.insert(cases.end(), Case{r.name, r.from, r.what, {}, {}});
    if (!r.failed.empty()) {
      found->failed = r.failed;
      continue;
    }
    auto sum = std::ranges::find_if(found->sums,
                                    [&](const CaseSum& s) { return s.label == r.label && s.numeric == r.numeric; });
    if (sum == found->sums.end())
      sum = found->sums.insert(found->sums.end(), CaseSum{.label = r.label, .numeric = r.numeric, .accuracy = {}});
    sum->add(r);
  }
  return cases;
}

/// Returns the numeric modes of the records, in the registry's order.
std::vector<std::string> modes_of(const std::vector<HardRecord>& records) {
  std::vector<std::string> modes;
  for (const NumericMode& mode : kNumericModes)
    if (std::ranges::any_of(records, [&](const HardRecord& r) { return r.numeric == mode.name; }))
      modes.emplace_back(mode.name);
  return modes;
}

void add_row(bench::Table& table, const Case& c, const CaseSum& s) {
  const bench::Accuracy& a = s.accuracy;
  std::vector<std::string> cells{c.name, s.numeric, s.badness() == 0 ? "all equal" : s.label};
  for (const std::uint64_t n : {a.rays, s.leaks, a.false_misses, a.false_hits, a.wrong_prims, a.ties, a.wrong_values,
                                a.beyond_bound, s.unlike, s.differing, a.unwritten})
    cells.push_back(std::to_string(n));
  cells.push_back(s.broken ? "**broken**" : bench::is_conservative(s.numeric) ? "kept" : "-");
  table.row(std::move(cells));
}

std::string short_text(const CaseSum& s) {
  const std::uint64_t wrong = s.accuracy.wrong() + s.accuracy.wrong_values;
  if (s.badness() == 0) return "0";
  std::string text = fmt::format("{} wrong", wrong);
  if (s.leaks) text += fmt::format(", {} leaks", s.leaks);
  if (s.accuracy.beyond_bound) text += fmt::format(", {} beyond", s.accuracy.beyond_bound);
  if (s.differing) text += fmt::format(", {} differ", s.differing);
  return s.broken ? bench::bold(text) : text;
}

}  // namespace

std::string hard_table(const std::vector<HardRecord>& records) {
  if (records.empty()) return "";
  bench::Table table({"hard case", "mode", "worst method", "rays", "leaks", "false misses", "false hits", "wrong prims",
                      "ties", "wrong values", "beyond bound", "unlike known", "differ", "unwritten", "promise"},
                     3);
  for (const Case& c : cases_of(records)) {
    for (const std::string& mode : modes_of(records))
      if (const CaseSum* worst = c.worst(mode)) add_row(table, c, *worst);
    if (!c.failed.empty()) table.row({c.name, "", "failed: " + c.failed});
  }
  return table.text();
}

std::string hard_summary(const std::vector<HardRecord>& records) {
  if (records.empty()) return "";
  std::vector<std::string> header{"hard case", "from"};
  const auto modes = modes_of(records);
  header.insert(header.end(), modes.begin(), modes.end());
  bench::Table table(header, 2);
  for (const Case& c : cases_of(records)) {
    std::vector<std::string> cells{c.name, c.from};
    for (const std::string& mode : modes) {
      const CaseSum* worst = c.worst(mode);
      cells.push_back(!c.failed.empty() ? "failed" : worst ? short_text(*worst) : "");
    }
    table.row(std::move(cells));
  }
  return table.text();
}

std::string hard_list(const std::vector<HardRecord>& records) {
  std::string text;
  for (const Case& c : cases_of(records)) text += fmt::format("- `{}`: {} ({})\n", c.name, c.what, c.from);
  return text.empty() ? "" : text + "\n";
}

}  // namespace ballot::verify
