// Two runs held against each other: is the second slower beyond noise?
#pragma once

#include <string>
#include <vector>

#include "tools/bench/document.h"

namespace ballot::bench {

/// Time per ray in B over that in A, of medians, with an interval for it.
struct Ratio {
  double ratio = 1, low = 1, high = 1;
};

/// Fewer samples than this of a record in A or B, and no verdict is given on it.
inline constexpr std::size_t kLeastSamples = 6;

struct Change {
  std::string setting, scene, rays, label, numeric, view;  // view: "" in groups
  Ratio time;
  std::size_t samples = 0;  // of the record that has the fewest

  bool judged() const { return samples >= kLeastSamples; }
  bool slower(double tolerance) const { return judged() && time.low > 1 + tolerance; }
  bool faster(double tolerance) const { return judged() && time.high < 1 / (1 + tolerance); }
};

struct Comparison {
  std::vector<Change> groups;               // geometric means over views: these decide
  std::vector<Change> records;              // single views, for information, with intervals of 95 %
  double confidence = 0.95;                 // of the intervals of groups, so that all of them hold with 95 %
  std::vector<std::string> only_a, only_b;  // records, in words
  std::vector<std::string> warnings;        // what makes the two hard to compare
  std::vector<std::string> notes;           // what else to know
  bool several_settings = false;            // settings are then named
};

/// Records match by setting (device, driver, subgroup size, clock, picture size), scene, view, rays, any, label and
/// numeric; sweeps are left out. Where A and B have one setting each, these need not be equal. The intervals are
/// bootstrapped from the samples with a fixed seed. Throws Error(Work) if nothing matches.
Comparison compare(const std::vector<Document>& a, const std::vector<Document>& b);

/// Prints tables and lists. True if some group is slower beyond tolerance.
bool print_comparison(const Comparison& comparison, double tolerance);

nlohmann::json comparison_json(const Comparison& comparison, double tolerance);

}  // namespace ballot::bench
