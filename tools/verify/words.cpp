// The sentences on a run's results, and the list of its wrong answers.
#include <algorithm>
#include <map>
#include <set>

#include "tools/verify/tables.h"

namespace ballot::verify {

namespace {

using bench::Accuracy;

/// Returns the sums over all answers of each mode, of scenes and hard cases.
std::map<std::string, Accuracy> totals_of(const bench::Document& document) {
  std::map<std::string, Accuracy> totals;
  for (const bench::Record& r : document.records)
    if (r.accuracy) totals[r.numeric].add(*r.accuracy);
  for (const bench::HardRecord& r : document.hard)
    if (r.failed.empty()) totals[r.numeric].add(r.accuracy);
  return totals;
}

std::string beyond_text(const Accuracy& a, const std::string& numeric) {
  const std::string bound = bench::is_conservative(numeric) ? "its bound" : "the bound of its arithmetic";
  if (a.beyond_bound == 0) return "none beyond " + bound;
  return fmt::format("{} beyond {}", a.beyond_bound, bound);
}

std::string sentence_of(const std::string& numeric, const Accuracy& a) {
  std::string text = numeric + ": ";
  if (a.wrong() == 0)
    text += fmt::format("none of {} answers wrong", count_text(a.rays));
  else
    text += fmt::format("{} of {} answers wrong ({} per million), {}", a.wrong(), count_text(a.rays),
                        rate_text(per_million(a.wrong(), a.rays)), beyond_text(a, numeric));
  if (a.wrong_values > 0) text += fmt::format(", {} with t, u or v beyond the bound", a.wrong_values);
  if (a.ties > 0 && bench::is_exact(numeric)) text += fmt::format(", {} ties not settled by number", a.ties);
  if (a.beyond_range > 0)
    text += fmt::format(", {} beyond its range (direction below 1.18e-38, or origin too far away)", a.beyond_range);
  if (a.unwritten > 0) text += fmt::format(", {} not written", a.unwritten);
  return text;
}

std::string case_line(const bench::WrongAnswer& c) {
  const auto prim = [](std::uint32_t p, double t) {
    return p == NO_HIT ? std::string("a miss") : fmt::format("prim {} at t = {:.9g}", p, t);
  };
  return fmt::format(
      "  - {}{}: {}. Ray {}: origin {:.9g} {:.9g} {:.9g}, direction {:.9g} {:.9g} {:.9g}, t in [{:.9g}, {:.9g}]; "
      "answer {}, truth {}.\n",
      c.kind, c.within_bound ? ", within the bound" : ", **beyond the bound**", c.reason, c.index, c.ray.origin.x,
      c.ray.origin.y, c.ray.origin.z, c.ray.dir.x, c.ray.dir.y, c.ray.dir.z, c.ray.t_min, c.ray.t_max,
      prim(c.answer.prim, double(c.answer.t)), prim(c.prim, c.t));
}

/// Returns a list of wrong answers; those that no bound explains come first.
std::string cases_text(const std::string& place, std::vector<bench::WrongAnswer> cases, std::size_t most) {
  if (cases.empty()) return "";
  std::ranges::stable_sort(cases, {}, &bench::WrongAnswer::within_bound);
  std::string text = "- " + place + "\n";
  for (std::size_t i = 0; i < std::min(cases.size(), most); ++i) text += case_line(cases[i]);
  if (cases.size() > most) text += fmt::format("  - and {} more in verify.json\n", cases.size() - most);
  return text;
}

}  // namespace

std::string verdict(const bench::Document& document) {
  std::string text;
  const auto totals = totals_of(document);
  const auto add = [&](const std::string& numeric) {
    const auto found = totals.find(numeric);
    if (found != totals.end()) text += (text.empty() ? "" : "; ") + sentence_of(numeric, found->second);
  };
  for (const NumericMode& mode : kNumericModes) add(std::string(mode.name));
  return text.empty() ? "no answer was checked against the exact oracle" : text + ".";
}

std::string case_list(const std::vector<Platform>& platforms, const std::vector<bench::Document>& documents,
                      std::size_t most) {
  std::string text;
  for (const Platform& platform : platforms)
    for (const Place& place : platform.places)
      for (const std::string& mode : platform.modes())
        if (const Row* row = worst_row(place, mode))
          text += cases_text(fmt::format("{}{}, {}, {}, {}", platforms.size() > 1 ? platform.name + ": " : "",
                                         place.scene, place.rays, mode, row->label),
                             row->accuracy.cases, most);
  for (const bench::Document& document : documents) {
    std::set<std::string> shown;
    for (const bench::HardRecord& r : document.hard) {
      const std::string place = fmt::format("hard case {}, {}, {}", r.name, r.rays, r.numeric);
      if (!r.accuracy.cases.empty() && shown.insert(place).second)
        text += cases_text(place + ", " + r.label, r.accuracy.cases, most);
    }
  }
  return text;
}

}  // namespace ballot::verify
