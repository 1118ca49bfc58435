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
  double put_off_s = 0;      // if it was put off: the seconds that compiling it and a first look should take; else 0
  std::string name() const;  // "packet-wide fallback=0"
};

/// Returns the candidates of auto for a query on a device, in the order in which they are tried. On CPUs the first
/// compiles fastest, and the second suits the query's ray class. Every candidate gets the knobs of the query; one that
/// cannot follow them is left out. If none is left, throws Error(Arguments) with the reason for the first. `triangles`:
/// of the scene. Candidates that sort rays (knob reorder) are for large scenes alone.
std::vector<Candidate> candidates_for(const Query& query, const DeviceInfo& device, std::size_t triangles = 0);

/// Returns the seconds in which a quiet device of this kind is expected to compile a candidate and to trace a few rays.
/// 0: unknown.
double entry_seconds(const Candidate& candidate, const DeviceInfo& device);

/// Returns the query that auto runs before there is a choice: on batches too small for a trial, and on the first rays
/// of others.
Query unmeasured(const Query& query, const DeviceInfo& device);

/// The choice of auto for one ray class, kind of hit, numeric mode and set of knobs.
struct Choice {
  std::string rays;  // Query::rays
  Want want = Want::Nearest;
  std::string numeric;
  Knobs knobs;                        // given by the query
  std::vector<Candidate> candidates;  // the chosen one first, then those of the last race by speed, then the others
  std::uint32_t sampled = 0;          // rays of a sample: the most that a candidate traces in a round
  double seconds = 0;                 // wall time of the last trial, with compiling and deriving trees
  bool remembered = false;            // read from disk, and no new candidate was tried by this process
  int runs = 0;                       // processes that tried candidates
  double since_entry_s = 0;           // estimated device time of its rays since the last trial of a new candidate

  // Not stored. They tell when the next trial of this process is due (chooser.h).
  double traced_s = 0;       // the same, since the last trial
  double trial_s = 0;        // seconds of the next trial, estimated from the last one; 0: unknown
  std::uint64_t buffer = 0;  // Buffer::id() of the rays that were tried

  /// Returns true if every candidate was tried or put off. CPU drivers take 0.1 to 0.7 s to compile a kernel, so
  /// candidates that one process has no time for are left to the next. After kRunsOfTrials none is left.
  bool complete() const;
  /// Returns how many seconds compiling a candidate that was put off may take: a share of since_entry_s or, if that is
  /// more, of the time of a batch of `rays` rays.
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

// Shares of the time that the rays of a choice have taken. Rays that are likely to be coherent may take half of it with
// packets, so that more may be spent on compiling these.
inline constexpr double kShareOfTrials = 0.05;    // for trials, and for compiling a candidate that was put off
inline constexpr double kShareIfCoherent = 0.25;  // for the latter, if rays are likely to be coherent
inline constexpr double kShareOfLooks = 0.01;     // for another race of the fastest

/// The choices for one scene on one device. They are kept in memory and, if a folder is given, in a JSON file in it.
/// The file's name follows from the device, driver, subgroup size, Ballot's commit and the tree. A file that cannot be
/// read or written is ignored.
class Choices {
 public:
  Choices(const DeviceInfo& device, const BvhStats& tree, const Bounds& bounds);
  /// Stores what was traced for candidates that were put off.
  ~Choices();
  Choices(const Choices&) = delete;
  Choices& operator=(const Choices&) = delete;

  /// Reads the choices that the folder has for this scene and device, and stores new ones there.
  void keep_in(const std::filesystem::path& folder);

  /// Replaces the tree. The choices for the new one are read from the folder, if one was given.
  void replace_scene(const BvhStats& tree, const Bounds& bounds);

  /// Returns the choice for a query, or null. It is valid until the choices change.
  const Choice* find(const Query& query) const;
  /// Returns true if a candidate for a query was tried on rays of any class, in this process or an earlier one. Its
  /// kernel is the same for all, so that the driver has its code.
  bool has_tried(const Query& query, const Candidate& candidate) const;
  /// Adds the time of `rays` rays to traced_s and since_entry_s of the choice for a query, if there is one.
  void note(const Query& query, std::size_t rays);
  void add(Choice choice);
  void clear() { all_.clear(), ++changes_; }
  /// For measurements of what auto chooses in the long run. If set, the first trial tries every candidate, however
  /// long that takes, and the fastest race again for each new buffer of rays.
  bool try_all = false;
  /// Drops the choices, and keeps no more on disk.
  void forget() { folder_.clear(), file_.clear(), clear(); }
  /// Returns how often the results of find() may have changed.
  std::uint64_t changes() const { return changes_; }
  std::vector<Choice> all() const;

 private:
  void load();
  void save() const;
  void store_noted();

  const DeviceInfo& device_;
  std::size_t triangles_;                // in the scene
  std::string scene_;                    // text that tells this tree from others
  std::filesystem::path folder_, file_;  // empty: none
  std::map<std::string, Choice> all_;
  bool noted_ = false;  // rays were traced that count towards a candidate that was put off
  std::uint64_t changes_ = 0;
};

}  // namespace ballot
