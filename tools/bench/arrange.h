// The records of several runs in the order of a report: setting, scene and ray kind, entry, view.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tools/bench/document.h"

namespace ballot::bench {

/// An entry on all views of one scene and ray kind.
struct Cell {
  std::string label;
  Role role = Role::Method;
  std::map<std::string, const Record*> views;

  const Record& first() const { return *views.begin()->second; }
  double total_ms() const;            // sum of the medians
  double mrays_per_s() const;         // all rays over total_ms()
  std::optional<double> fps() const;  // mean over views of 1000 / frame median; none if no view has frames
};

/// Time of a over time of b, on the views that both have.
std::optional<double> time_ratio(const Cell& a, const Cell& b);

/// A scene and a ray kind.
struct Block {
  std::string scene, rays;  // rays of an any-hit query of a .npy file end in ":any"
  std::vector<Cell> cells;  // without the thresholds of sweeps, in the order of the records
  std::vector<Cell> sweep;

  const Cell* find(const std::string& label) const;
  bool whole(const Cell& cell) const;  // it has every view that some entry has, so that sums over views compare
};

/// What may be compared: one device and driver, clock, picture size, ao rays and numeric mode.
struct Setting {
  std::string name;  // the device and as much more as tells it from the others
  std::string numeric;
  const Document* document;  // of its first record
  std::vector<Block> blocks;

  std::vector<std::string> labels() const;  // of cells, in order of first appearance
  std::vector<std::string> ray_kinds() const;
  std::vector<std::string> scenes() const;
  const Block* find(const std::string& scene, const std::string& rays) const;
};

/// One device and driver, clock, picture size and ao rays.
bool same_platform(const Document& a, const Document& b);

/// Adds to names, one a document, what tells the documents apart, until no two are alike.
void tell_apart(std::vector<std::string>& names, const std::vector<const Document*>& documents);

struct Arranged {
  std::vector<Setting> settings;
  std::uint64_t replaced = 0;  // records that a later document measured again
};

/// Keeps pointers into `documents`.
Arranged arrange(const std::vector<Document>& documents);

double geometric_mean(const std::vector<double>& values);

}  // namespace ballot::bench
