#include "tools/bench/compare.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <tuple>

namespace ballot::bench {

namespace {

constexpr int kDraws = 1000;  // number of resamples of the bootstrap

/// The key by which records match: setting, scene, rays, any, numeric, label, view.
using Key = std::tuple<std::string, std::string, std::string, bool, std::string, std::string, std::string>;

struct Placed {
  const Record* record;
  std::string setting;
};
using Records = std::map<Key, Placed>;

std::string words(const Placed& placed, bool with_setting) {
  const Record& r = *placed.record;
  return fmt::format("{}{}, {}{}{}, {}, {}", with_setting ? placed.setting + ": " : "", r.scene,
                     r.view.empty() ? "" : r.view + ", ", r.rays, r.any ? " (any)" : "", r.label, r.numeric);
}

std::string ao_text(const Document& d) { return fmt::format("{} ao rays of {:g}", d.ao_rays, d.ao_radius); }

bool is_standard_ao(const Document& d) { return ao_text(d) == ao_text(Document{}); }

/// Returns everything except the numeric mode that must be equal for times to be comparable.
std::string setting_of(const Document& d) {
  return fmt::format("{}, {}, subgroups of {}, {}x{}, {}{}{}", d.device, d.driver, d.subgroup_size, d.size[0],
                     d.size[1], d.clock, is_standard_ao(d) ? "" : ", " + ao_text(d),
                     d.offset == kDefaultOffset ? "" : ", offset " + d.offset);
}

std::set<std::string> settings_of(const std::vector<Document>& documents) {
  std::set<std::string> all;
  for (const Document& d : documents) all.insert(setting_of(d));
  return all;
}

/// Returns the records by key. If a record was measured twice, the later one counts, as in reports. `one`: each side
/// has one setting, which is left out of the keys.
Records by_key(const std::vector<Document>& documents, bool one) {
  Records all;
  for (const Document& d : documents)
    for (const Record& r : d.records)
      if (r.role != Role::Sweep) {
        const std::string setting = one ? "" : setting_of(d);
        all[{setting, r.scene, r.rays, r.any, r.numeric, r.label, r.view}] = {&r, setting};
      }
  return all;
}

double median_of_draw(const std::vector<double>& samples, std::mt19937& random, std::vector<double>& drawn) {
  drawn.clear();
  for (std::size_t i = 0; i < samples.size(); ++i) drawn.push_back(samples[random() % samples.size()]);
  const std::size_t middle = drawn.size() / 2;
  std::ranges::nth_element(drawn, drawn.begin() + std::ptrdiff_t(middle));
  const double upper = drawn[middle];
  if (drawn.size() % 2) return upper;
  return (*std::max_element(drawn.begin(), drawn.begin() + std::ptrdiff_t(middle)) + upper) / 2;
}

/// Returns the logarithms of the ratio of medians, one for each resample: both records' samples drawn with replacement.
std::vector<double> bootstrap(const Record& a, const Record& b, double log_rays, std::mt19937& random) {
  std::vector<double> logs, drawn;
  for (int i = 0; i < kDraws; ++i) {
    const double time_a = median_of_draw(a.trace.samples, random, drawn);
    const double time_b = median_of_draw(b.trace.samples, random, drawn);
    logs.push_back(std::log(time_b / time_a) + log_rays);
  }
  return logs;
}

/// Returns the value that a standard normal deviate exceeds with this probability.
double upper_normal(double probability) {
  double low = 0, high = 40;
  for (int i = 0; i < 80; ++i) {
    const double middle = (low + high) / 2;
    (std::erfc(middle / std::sqrt(2.0)) / 2 > probability ? low : high) = middle;
  }
  return low;
}

/// Returns an interval that contains the ratio with this confidence. Each end is the further out of two: the
/// bootstrap's quantile, and the end that the bootstrap's standard error gives for a normal distribution. The second
/// one stands for tails that the draws are too few to show.
Ratio interval(double log_ratio, const std::vector<double>& logs, double confidence) {
  const double tail = (1 - confidence) / 2;
  double mean = 0, squares = 0;
  for (const double log : logs) mean += log / double(logs.size());
  for (const double log : logs) squares += (log - mean) * (log - mean);
  const double reach = upper_normal(tail) * std::sqrt(squares / double(logs.size() - 1));
  return {std::exp(log_ratio), std::exp(std::min(quantile(logs, tail), log_ratio - reach)),
          std::exp(std::max(quantile(logs, 1 - tail), log_ratio + reach))};
}

/// Sums over the views of one setting, scene, ray kind, numeric mode and label.
struct Group {
  Change change;
  double log_ratio = 0;
  std::vector<double> logs;
  int views = 0;
};

bool same_group(const Change& a, const Change& b) {
  const auto place = [](const Change& c) { return std::tie(c.setting, c.scene, c.rays, c.numeric, c.label); };
  return place(a) == place(b);
}

void add_to_groups(const Change& record, double log_ratio, const std::vector<double>& logs,
                   std::vector<Group>& groups) {
  if (groups.empty() || !same_group(groups.back().change, record)) {
    groups.push_back({record, 0, std::vector<double>(kDraws), 0});
    groups.back().change.view.clear();
  }
  Group& group = groups.back();
  for (std::size_t i = 0; i < logs.size(); ++i) group.logs[i] += logs[i];
  group.log_ratio += log_ratio;
  group.change.samples = std::min(group.change.samples, record.samples);
  ++group.views;
}

/// Computes the intervals of the groups. Their confidence is raised with the number of verdicts (Bonferroni
/// correction).
void finish(std::vector<Group>& groups, Comparison& comparison) {
  const auto judged = std::ranges::count_if(groups, [](const Group& g) { return g.change.judged(); });
  comparison.confidence = 1 - 0.05 / double(std::max<std::ptrdiff_t>(judged, 1));
  for (Group& group : groups) {
    for (double& log : group.logs) log /= group.views;
    group.change.time = interval(group.log_ratio / group.views, group.logs, comparison.confidence);
    comparison.groups.push_back(group.change);
  }
}

void compare_pairs(const Records& in_a, const Records& in_b, Comparison& comparison) {
  std::mt19937 random(1);
  std::vector<Group> groups;
  for (const auto& [key, placed] : in_a) {
    const auto found = in_b.find(key);
    if (found == in_b.end()) continue;
    const Record &a = *placed.record, &b = *found->second.record;
    if (a.ray_count == 0 || b.ray_count == 0) continue;
    const double log_rays = std::log(double(a.ray_count) / double(b.ray_count));
    const double log_ratio = std::log(b.trace.median / a.trace.median) + log_rays;
    const std::size_t samples = std::min(a.trace.samples.size(), b.trace.samples.size());
    const std::vector<double> logs =
        samples < 2 ? std::vector<double>(kDraws, log_ratio) : bootstrap(a, b, log_rays, random);
    const Change change{placed.setting, a.scene, a.rays + (a.any ? " (any)" : ""), a.label,
                        a.numeric,      a.view,  interval(log_ratio, logs, 0.95),  samples};
    comparison.records.push_back(change);
    add_to_groups(change, log_ratio, logs, groups);
  }
  finish(groups, comparison);
}

template <class Part>
void warn_if_different(const char* what, const Document& a, const Document& b, Part part,
                       std::vector<std::string>& warnings) {
  if (part(a) != part(b)) warnings.push_back(fmt::format("the {}s differ: {} and {}", what, part(a), part(b)));
}

void warn_of_settings(const Document& a, const Document& b, std::vector<std::string>& warnings) {
  warn_if_different(
      "device", a, b, [](const Document& d) { return d.device; }, warnings);
  warn_if_different(
      "driver", a, b, [](const Document& d) { return d.driver; }, warnings);
  warn_if_different(
      "subgroup size", a, b, [](const Document& d) { return d.subgroup_size; }, warnings);
  warn_if_different(
      "clock", a, b, [](const Document& d) { return d.clock; }, warnings);
  warn_if_different(
      "size", a, b, [](const Document& d) { return fmt::format("{}x{}", d.size[0], d.size[1]); }, warnings);
  warn_if_different("number or length of ao ray", a, b, ao_text, warnings);
  warn_if_different(
      "offset policy of ray", a, b, [](const Document& d) { return d.offset; }, warnings);
}

void warn_of_partial(const char* side, const std::vector<Document>& documents, std::vector<std::string>& warnings) {
  for (const Document& d : documents)
    if (d.partial)
      warnings.push_back(
          fmt::format("{} ({}, {}) is partial: that run was interrupted, and its missing records are not compared",
                      side, d.source, d.device));
}

}  // namespace

Comparison compare(const std::vector<Document>& a, const std::vector<Document>& b) {
  Comparison comparison;
  const auto settings_a = settings_of(a), settings_b = settings_of(b);
  const bool one = settings_a.size() == 1 && settings_b.size() == 1;
  comparison.several_settings = !one;
  if (one) warn_of_settings(a.front(), b.front(), comparison.warnings);
  warn_of_partial("A", a, comparison.warnings);
  warn_of_partial("B", b, comparison.warnings);
  const Records in_a = by_key(a, one), in_b = by_key(b, one);
  for (const auto& [key, placed] : in_a)
    if (!in_b.contains(key)) comparison.only_a.push_back(words(placed, !one));
  for (const auto& [key, placed] : in_b)
    if (!in_a.contains(key)) comparison.only_b.push_back(words(placed, !one));
  if (comparison.only_a.size() == in_a.size())
    fail(Failure::Work,
         "{} and {} have no record in common: found {} and {} records, expected some of equal {}scene, view, rays, "
         "label and numeric",
         a.front().source, b.front().source, in_a.size(), in_b.size(), one ? "" : "device, driver, size, ");
  compare_pairs(in_a, in_b, comparison);
  const auto on_cpu = [](const Document& d) { return d.cpu; };
  if (std::ranges::any_of(a, on_cpu) || std::ranges::any_of(b, on_cpu))
    comparison.notes.emplace_back(
        "on a CPU device the speed of a kernel can differ by up to 40 % between two compiles of it, and no interval "
        "here "
        "covers that; compare several runs");
  return comparison;
}

}  // namespace ballot::bench
