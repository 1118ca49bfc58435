// Method auto: its candidates, its choices, and the file that keeps the choices.
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

/// A method, with knobs, that auto may choose.
struct Candidate {
  std::string method;
  Knobs knobs;             // they override the tuning table
  double mrays_per_s = 0;  // million rays a second, on the sample; 0: could not run, or was not tried
  bool tried = false;
  double put_off_s = 0;      // not tried, as compiling takes at least so many seconds; else 0
  std::string name() const;  // "packet-wide fallback=0"
};

/// Returns the candidates of auto for a query on a device, in the order in which they are tried: the one that compiles
/// fastest, then those that are likely for the query's ray class. Every candidate gets the knobs of the query; one that
/// cannot follow them is left out. If none is left, throws Error(Arguments) with the reason for the first. `triangles`:
/// of the scene; rays are sorted (knob reorder) in large ones alone.
std::vector<Candidate> candidates_for(const Query& query, const DeviceInfo& device, std::size_t triangles = 0);

/// Returns the seconds that a candidate is expected to take to compile and to trace a few rays on such a device, if it
/// is quiet. 0: unknown.
double entry_seconds(const Candidate& candidate, const DeviceInfo& device);

/// Returns the query that auto runs without a trial, on batches that are too small for a trial to pay.
Query unmeasured(const Query& query, const DeviceInfo& device);

/// The choice of auto for one ray class, kind of hit, numeric mode and set of knobs.
struct Choice {
  std::string rays;  // Query::rays
  Want want = Want::Nearest;
  std::string numeric;
  Knobs knobs;                        // given by the query
  std::vector<Candidate> candidates;  // the chosen one first, then by speed
  std::uint32_t sampled = 0;          // rays that each candidate traced
  double seconds = 0;                 // wall time of the calibration, with compiling and deriving trees
  bool remembered = false;            // read from disk, not measured by this process
  int runs = 0;                       // processes that tried candidates

  // Since the last trial of this process; not stored. By these the next one becomes due (chooser.h).
  double traced_s = 0;       // an estimate of the time that the device took for rays of this choice
  double since_entry_s = 0;  // the same, since the last trial of a new candidate
  double trial_s = 0;        // what the next trial will take, as far as the last one tells; 0: unknown
  std::uint64_t buffer = 0;  // Buffer::id() of the rays that were tried

  /// Returns true if every candidate was tried or put off. CPU drivers take 0.1 to 0.7 s to compile a kernel, so
  /// candidates that one process has no time for are left to the next. After kRunsOfTrials none is left.
  bool complete() const;
  /// Returns the seconds of compiling that since_entry_s pays for, or a batch of `rays` rays if it pays for more.
  double paid_s(std::size_t rays = 0) const;
  /// Returns true if a candidate that was put off takes no more than `time_s` seconds to compile.
  bool pays(double time_s) const;
  /// Returns in how many processes, this one included, the untried candidates are tried.
  int runs_left() const;

  const Candidate& chosen() const { return candidates.front(); }
  /// Returns the query with the chosen method and knobs.
  Query apply(Query query) const;
};

/// After trials in so many processes a choice is complete.
inline constexpr int kRunsOfTrials = 3;

/// Shares of the time that rays of a choice have taken: what trials may take; what a candidate that was put off may
/// take to compile if the rays are likely to be coherent; and what another race of the fastest may take. The second is
/// high because packets of many rays save up to half of the time of coherent rays.
inline constexpr double kShareOfTrials = 0.05, kShareIfCoherent = 0.25, kShareOfLooks = 0.01;

/// The choices for one scene on one device. They are kept in memory and, if a folder is given, in a JSON file in it.
/// The file's name follows from the device, driver, subgroup size, Ballot's commit and the tree. A file that cannot be
/// read or written is ignored.
class Choices {
 public:
  Choices(const DeviceInfo& device, const BvhStats& tree, const Bounds& bounds);

  /// Reads the choices that the folder has for this scene and device, and stores new ones there.
  void keep_in(const std::filesystem::path& folder);

  /// Replaces the tree. The choices for the new one are read from the folder, if one was given.
  void replace_scene(const BvhStats& tree, const Bounds& bounds);

  /// Returns the choice for a query, or null. It is valid until the choices change.
  const Choice* find(const Query& query) const;
  /// Adds to traced_s of the choice for a query, if there is one.
  void note(const Query& query, std::size_t rays);
  void add(Choice choice);
  void clear() { all_.clear(), ++changes_; }
  /// Set: every candidate is tried at once, however long that takes, and the fastest ones again for each buffer of
  /// rays, as a long run on them would. For measurements, which are about the choice.
  bool try_all = false;
  /// Drops the choices, and keeps no more on disk.
  void forget() { folder_.clear(), file_.clear(), clear(); }
  /// Returns how often the results of find() may have changed.
  std::uint64_t changes() const { return changes_; }
  std::vector<Choice> all() const;

 private:
  void load();
  void save() const;

  const DeviceInfo& device_;
  std::size_t triangles_;                // in the scene
  std::string scene_;                    // text that tells this tree from others
  std::filesystem::path folder_, file_;  // empty: none
  std::map<std::string, Choice> all_;
  std::uint64_t changes_ = 0;
};

}  // namespace ballot
