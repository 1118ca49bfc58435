#include "tools/bench/compare.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <tuple>

namespace ballot::bench {

namespace {

constexpr int kDraws = 1000;  // of the bootstrap

using Key = std::tuple<std::string, std::string, bool, std::string, std::string, std::string>;

Key key_of(const Record& r) { return {r.scene, r.rays, r.any, r.numeric, r.label, r.view}; }

std::string words(const Record& r) {
  return fmt::format("{}, {}{}{}, {}, {}", r.scene, r.view.empty() ? "" : r.view + ", ", r.rays, r.any ? " (any)" : "",
                     r.label, r.numeric);
}

std::map<Key, const Record*> by_key(const std::vector<Document>& documents) {
  std::map<Key, const Record*> all;
  for (const Document& d : documents)
    for (const Record& r : d.records)
      if (r.role != Role::Sweep) all[key_of(r)] = &r;
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

/// Logarithms of the ratio of medians over draws with replacement from both.
std::vector<double> bootstrap(const Record& a, const Record& b, double log_rays, std::mt19937& random) {
  std::vector<double> logs, drawn;
  for (int i = 0; i < kDraws; ++i) {
    const double time_a = median_of_draw(a.trace.samples, random, drawn);
    const double time_b = median_of_draw(b.trace.samples, random, drawn);
    logs.push_back(std::log(time_b / time_a) + log_rays);
  }
  return logs;
}

Ratio interval(double log_ratio, const std::vector<double>& logs) {
  return {std::exp(log_ratio), std::exp(quantile(logs, 0.025)), std::exp(quantile(logs, 0.975))};
}

/// Records of one scene, ray kind, numeric mode and label.
struct Group {
  Change change;
  double log_ratio = 0;
  std::vector<double> logs;
  int views = 0;
};

void finish(Group& group, std::vector<Change>& groups) {
  if (group.views == 0) return;
  for (double& log : group.logs) log /= group.views;
  group.change.time = interval(group.log_ratio / group.views, group.logs);
  groups.push_back(group.change);
}

void compare_pairs(const std::map<Key, const Record*>& in_a, const std::map<Key, const Record*>& in_b,
                   Comparison& comparison) {
  std::mt19937 random(1);
  Group group;
  for (const auto& [key, a] : in_a) {
    const auto found = in_b.find(key);
    if (found == in_b.end()) continue;
    const Record& b = *found->second;
    if (a->trace.samples.size() < 2 || b.trace.samples.size() < 2 || a->ray_count == 0 || b.ray_count == 0) {
      ++comparison.without_samples;
      continue;
    }
    const double log_rays = std::log(double(a->ray_count) / double(b.ray_count));
    const double log_ratio = std::log(b.trace.median / a->trace.median) + log_rays;
    const std::vector<double> logs = bootstrap(*a, b, log_rays, random);
    Change change{a->scene, a->rays + (a->any ? " (any)" : ""), a->label, a->numeric,
                  a->view,  interval(log_ratio, logs)};
    comparison.records.push_back(change);
    change.view.clear();
    const auto place = [](const Change& c) { return std::tie(c.scene, c.rays, c.numeric, c.label); };
    if (group.views == 0 || place(group.change) != place(change)) {
      finish(group, comparison.groups);
      group = {change, 0, std::vector<double>(kDraws), 0};
    }
    for (int i = 0; i < kDraws; ++i) group.logs[std::size_t(i)] += logs[std::size_t(i)];
    group.log_ratio += log_ratio;
    ++group.views;
  }
  finish(group, comparison.groups);
}

template <class Part>
void warn_if_different(const char* what, const Document& a, const Document& b, Part part,
                       std::vector<std::string>& warnings) {
  if (part(a) != part(b)) warnings.push_back(fmt::format("the {}s differ: {} and {}", what, part(a), part(b)));
}

}  // namespace

Comparison compare(const std::vector<Document>& a, const std::vector<Document>& b) {
  Comparison comparison;
  const Document &first = a.front(), &second = b.front();
  auto& warnings = comparison.warnings;
  warn_if_different(
      "device", first, second, [](const Document& d) { return d.device; }, warnings);
  warn_if_different(
      "driver", first, second, [](const Document& d) { return d.driver; }, warnings);
  warn_if_different(
      "clock", first, second, [](const Document& d) { return d.clock; }, warnings);
  warn_if_different(
      "size", first, second, [](const Document& d) { return fmt::format("{}x{}", d.size[0], d.size[1]); }, warnings);
  const auto in_a = by_key(a), in_b = by_key(b);
  for (const auto& [key, record] : in_a)
    if (!in_b.contains(key)) comparison.only_a.push_back(words(*record));
  for (const auto& [key, record] : in_b)
    if (!in_a.contains(key)) comparison.only_b.push_back(words(*record));
  if (comparison.only_a.size() == in_a.size())
    fail(Failure::Work,
         "{} and {} have no record in common: found {} and {} records, expected some of equal scene, view, rays, label "
         "and numeric",
         first.source, second.source, in_a.size(), in_b.size());
  compare_pairs(in_a, in_b, comparison);
  return comparison;
}

}  // namespace ballot::bench
