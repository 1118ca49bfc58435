// The records of several verified runs, arranged for a report: by platform, then scene and ray kind, then entry and
// numeric mode.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/bench/arrange.h"

namespace ballot::verify {

/// The results of an entry in one numeric mode, for all views of a scene and ray kind.
struct Row {
  std::string label, numeric;
  bench::Cell cell;          // the records, for their speeds
  bench::Accuracy accuracy;  // sums over the views; see Accuracy::add
};

/// The rows of one scene and ray kind.
struct Place {
  std::string scene, rays;
  std::vector<Row> rows;  // by entry, then by numeric mode
};

/// The records that may be compared with each other: those of one device, driver, clock, picture size and ao rays.
struct Platform {
  std::string name;  // the device, and as many more properties as distinguish it from the other platforms
  const bench::Document* document;  // of its first record
  std::vector<Place> places;

  std::vector<std::string> modes() const;  // the numeric modes of all rows: in the registry's order, then unknown ones
};

/// Arranges the verified records of documents; others are left out. The result keeps pointers into `documents`.
std::vector<Platform> platforms_of(const std::vector<bench::Document>& documents);

/// Returns the sums over all answers of a mode. Rays are counted once for each entry.
bench::Accuracy total_of(const Platform& platform, const std::string& numeric);

/// Returns the entry with the highest rate of wrong answers in this mode; null if there is no entry.
const Row* worst_row(const Place& place, const std::string& numeric);

/// The time of one numeric mode divided by that of another, over all places and entries that have both.
struct Cost {
  double median = 1, worst = 1;  // ratios of times
  std::string where;             // scene, rays and entry of the worst ratio
  std::size_t cases = 0;         // number of ratios
};
/// Returns the cost of mode `numeric` against mode `base`; none if no entry has both.
std::optional<Cost> cost_of(const Platform& platform, const std::string& numeric, const std::string& base);

/// Returns the mode that costs are relative to: `fast` if it was measured, else the one with the least time.
std::string base_mode(const Platform& platform);

/// Returns n as a rate per million rays; 0 if there are no rays.
double per_million(std::uint64_t n, std::uint64_t rays);

}  // namespace ballot::verify
