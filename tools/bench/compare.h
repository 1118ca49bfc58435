// The comparison of two runs: is the second one slower than noise explains?
#pragma once

#include <string>
#include <vector>

#include "tools/bench/document.h"

namespace ballot::bench {

/// The median time per ray in B divided by that in A, with a confidence interval.
struct Ratio {
  double ratio = 1, low = 1, high = 1;
};

/// The least number of samples of a record in A and in B for a verdict on it.
inline constexpr std::size_t kLeastSamples = 6;

/// The change of one record, or of one group of records, from A to B.
struct Change {
  std::string setting, scene, rays, label, numeric, view;  // view: "" in groups
  Ratio time;
  std::size_t samples = 0;  // the smallest number of samples of its records

  bool judged() const { return samples >= kLeastSamples; }
  bool slower(double tolerance) const { return judged() && time.low > 1 + tolerance; }
  bool faster(double tolerance) const { return judged() && time.high < 1 / (1 + tolerance); }
};

struct Comparison {
  std::vector<Change> groups;               // geometric means over views; these decide the verdict
  std::vector<Change> records;              // single views, for information, with 95 % intervals
  double confidence = 0.95;                 // of each group's interval, so that all of them hold together with 95 %
  std::vector<std::string> only_a, only_b;  // records that one side lacks, in words
  std::vector<std::string> warnings;        // differences that make the two runs hard to compare
  std::vector<std::string> notes;           // further caveats
  bool several_settings = false;            // there are several settings, so the tables name them
};

/// Compares the records of B with those of A. Records match if setting (device, driver, subgroup size, clock, picture
/// size), scene, view, rays, any, label and numeric mode are equal; sweeps are left out. If A and B have one setting
/// each, these two settings may differ. The intervals are bootstrapped from the samples with a fixed seed. Throws
/// Error(Work) if no records match.
Comparison compare(const std::vector<Document>& a, const std::vector<Document>& b);

/// Prints the comparison as tables and lists. Returns true if some group is slower by more than `tolerance`, a share.
bool print_comparison(const Comparison& comparison, double tolerance);

nlohmann::json comparison_json(const Comparison& comparison, double tolerance);

}  // namespace ballot::bench
