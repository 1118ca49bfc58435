// Method auto: what it may choose, what it has chosen, and where that is kept.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/bvh/bvh.h"
#include "engine/trace/query.h"

namespace ballot {

/// A method with knobs that auto may choose.
struct Candidate {
  std::string method;
  Knobs knobs;             // in addition to those of the tuning table
  double mrays_per_s = 0;  // on the sampled rays; 0: could not run, or was not tried
  bool tried = false;
  std::string name() const;  // "packet-wide fallback=0"
};

/// Returns the candidates for a query on a device, the likeliest first. Knobs of the query go to every candidate; a
/// candidate that cannot follow them is left out. Throws the Error(Arguments) of the first one if none is left.
std::vector<Candidate> candidates_for(const Query& query, const DeviceInfo& device);

/// Returns the query that auto runs without trials, on batches too small for trials to pay.
Query unmeasured(const Query& query, const DeviceInfo& device);

/// The choice of auto for one ray class.
struct Choice {
  std::string rays;  // Query::rays
  Want want = Want::Nearest;
  std::string numeric;
  Knobs knobs;                        // that the query gave
  std::vector<Candidate> candidates;  // the chosen one first, then by speed
  std::uint32_t sampled = 0;          // rays that each candidate traced
  double seconds = 0;                 // wall time of the calibration, compiling and derived trees included
  bool remembered = false;            // read from disk, not measured by this process

  /// True if every candidate was tried. CPU drivers take 0.1 to 0.7 s to compile a kernel, so candidates that one
  /// process has no time for are left to the next one.
  bool complete() const;

  const Candidate& chosen() const { return candidates.front(); }
  /// The query with the method and knobs that were chosen.
  Query apply(Query query) const;
};

/// The choices for one scene on one device, kept in memory and, if a folder is given, in a JSON file there. The file's
/// name follows from the device, the driver, the subgroup size, Ballot's commit and the tree. A file that cannot be
/// read or written counts as missing.
class Choices {
 public:
  Choices(const DeviceInfo& device, const BvhStats& tree, const Bounds& bounds);

  /// Reads what the folder has for this scene and device, and keeps new choices there.
  void keep_in(const std::filesystem::path& folder);

  /// Takes another tree: its choices are read from the folder, if one was given.
  void replace_scene(const BvhStats& tree, const Bounds& bounds);

  const Choice* find(const Query& query) const;
  void add(Choice choice);
  void clear() { all_.clear(), ++changes_; }
  /// A number that grows whenever the result of find() may have changed.
  std::uint64_t changes() const { return changes_; }
  std::vector<Choice> all() const;

 private:
  void load();
  void save() const;

  const DeviceInfo& device_;
  std::string scene_;                    // what tells this tree from others
  std::filesystem::path folder_, file_;  // empty: none
  std::map<std::string, Choice> all_;
  std::uint64_t changes_ = 0;
};

}  // namespace ballot
