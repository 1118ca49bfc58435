// Two runs held against each other: is the second slower beyond noise?
#pragma once

#include <string>
#include <vector>

#include "tools/bench/document.h"

namespace ballot::bench {

/// Time per ray in B over that in A, of medians, with an interval that holds it with 95 % confidence.
struct Ratio {
  double ratio = 1, low = 1, high = 1;
  bool slower(double tolerance) const { return low > 1 + tolerance; }
  bool faster(double tolerance) const { return high < 1 / (1 + tolerance); }
};

struct Change {
  std::string scene, rays, label, numeric, view;  // view: "" in groups, the geometric mean over views
  Ratio time;
};

struct Comparison {
  std::vector<Change> records, groups;
  std::vector<std::string> only_a, only_b;  // records, in words
  std::vector<std::string> warnings;        // what makes the two hard to compare
  std::size_t without_samples = 0;          // records of fewer than two samples on a side: not judged
};

/// Records match by scene, view, rays, any, label and numeric; sweeps are left out. The intervals are bootstrapped from
/// the samples with a fixed seed. Throws Error(Work) if nothing matches.
Comparison compare(const std::vector<Document>& a, const std::vector<Document>& b);

/// Prints tables and lists. True if some record or group is slower beyond tolerance.
bool print_comparison(const Comparison& comparison, double tolerance);

nlohmann::json comparison_json(const Comparison& comparison, double tolerance);

}  // namespace ballot::bench
