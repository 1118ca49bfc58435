// Records of several verified runs in the order of a report: platform, scene and ray kind, entry and numeric mode.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/bench/arrange.h"

namespace ballot::verify {

/// An entry in one numeric mode on all views of a scene and ray kind.
struct Row {
  std::string label, numeric;
  bench::Cell cell;          // the speeds
  bench::Accuracy accuracy;  // sums over the views; see Accuracy::add
};

/// A scene and a ray kind.
struct Place {
  std::string scene, rays;
  std::vector<Row> rows;  // entry after entry, of each all modes
};

/// What may be compared: one device, driver, clock, picture size and ao rays.
struct Platform {
  std::string name;                 // the device and as much more as tells it from the others
  const bench::Document* document;  // of its first record
  std::vector<Place> places;

  std::vector<std::string> modes() const;  // of all rows, in the registry's order, then others
};

/// Records that were not verified are left out. Keeps pointers into `documents`.
std::vector<Platform> platforms_of(const std::vector<bench::Document>& documents);

/// All answers of a mode; rays are counted once an entry.
bench::Accuracy total_of(const Platform& platform, const std::string& numeric);

/// The entry with the highest rate of wrong answers in this mode; null without one.
const Row* worst_row(const Place& place, const std::string& numeric);

/// What a mode costs in time against another, over all places and entries that have both.
struct Cost {
  double median = 1, worst = 1;  // ratios of times
  std::string where;             // of the worst: scene, rays, entry
  std::size_t cases = 0;
};
std::optional<Cost> cost_of(const Platform& platform, const std::string& numeric, const std::string& base);

/// The mode that costs are counted from: `fast` where it was measured, else the one of the least time.
std::string base_mode(const Platform& platform);

/// n in a million of `rays`.
double per_million(std::uint64_t n, std::uint64_t rays);

}  // namespace ballot::verify
