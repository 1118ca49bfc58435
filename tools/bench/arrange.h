// The records of several runs, arranged for a report: by setting, then scene and ray kind, then entry, then view.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tools/bench/document.h"

namespace ballot::bench {

/// The records of one entry for all views of one scene and ray kind.
struct Cell {
  std::string label;
  Role role = Role::Method;
  std::map<std::string, const Record*> views;

  const Record& first() const { return *views.begin()->second; }
  double total_ms() const;            // sum over views of the median trace times
  double mrays_per_s() const;         // all rays divided by total_ms()
  std::optional<double> fps() const;  // mean over views of 1000 / median frame time; none if no view has frames
};

/// Returns the time of a divided by the time of b, over the views that both have; none if there are no such views.
std::optional<double> time_ratio(const Cell& a, const Cell& b);

/// The entries of one scene and ray kind.
struct Block {
  std::string scene, rays;  // rays of an any-hit query of a .npy file end in ":any"
  std::vector<Cell> cells;  // all except the thresholds of sweeps, in the order of the records
  std::vector<Cell> sweep;  // the thresholds of sweeps

  const Cell* find(const std::string& label) const;
  bool whole(const Cell& cell) const;  // the cell has every view that some entry has, so sums over views are comparable
};

/// The records that may be compared with each other: those of one device and driver, clock, picture size, ao rays and
/// numeric mode.
struct Setting {
  std::string name;  // the device, and as many more properties as distinguish it from the other settings
  std::string numeric;
  const Document* document;  // of its first record
  std::vector<Block> blocks;

  std::vector<std::string> labels() const;  // of cells, in order of first appearance
  std::vector<std::string> ray_kinds() const;
  std::vector<std::string> scenes() const;
  const Block* find(const std::string& scene, const std::string& rays) const;
};

/// True if both documents have the same device, driver, subgroup size, clock, picture size, ao rays and offset policy.
bool same_platform(const Document& a, const Document& b);

/// Makes the names of documents distinct: appends driver, size and so on to names that are equal. `names` has one name
/// for each document.
void tell_apart(std::vector<std::string>& names, const std::vector<const Document*>& documents);

struct Arranged {
  std::vector<Setting> settings;
  std::uint64_t replaced = 0;  // records that were left out because a later one measured the same
};

/// Arranges the records of documents. The result keeps pointers into `documents`.
Arranged arrange(const std::vector<Document>& documents);

double geometric_mean(const std::vector<double>& values);

}  // namespace ballot::bench
