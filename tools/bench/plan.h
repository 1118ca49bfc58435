// The plan of a run of `ballot bench`: the command line's lists, checked and expanded into what is measured.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/bench/document.h"

namespace ballot::bench {

/// A method with its vote and knobs, and its label in tables. An entry is the unit that is measured.
struct Entry {
  std::string label;
  Role role = Role::Method;
  Query query;  // the rays set its want
  std::optional<ThresholdValue> threshold;
};

/// Entries that differ only in their threshold.
struct Sweep {
  std::string best_label;  // of the entry with the fastest threshold, such as "cut(best)"
  std::vector<Entry> entries;
};

/// The rays of one file.
struct RayFile {
  std::string view;  // empty if the set has one file; else the file's stem, or its path if two files have the same stem
  std::vector<Ray> rays;
};

/// The rays to trace: a ray kind, or rays from files. Files of one name take the place of a scene's views.
struct RaySet {
  std::string name;
  const RayKind* kind = nullptr;  // null: rays from files
  std::vector<RayFile> files = {};
  Want want = Want::Nearest;
};

struct PlanArgs {
  std::string methods = "all", rays = "primary,secondary", numeric{kDefaultNumeric}, views = "all";  // lists, or "all"
  std::string views_file;          // its views replace those of the scenes; empty: none
  std::vector<std::string> knobs;  // NAME=VALUE, for every method that has the knob
  bool sweep = false;
};

struct Plan {
  std::vector<Entry> entries;
  std::vector<Sweep> sweeps;
  std::vector<RaySet> rays;
  std::vector<std::string> views;  // empty: all
  std::vector<View> given_views;   // the views of PlanArgs::views_file

  std::vector<Query> queries() const;  // those of entries and sweeps, for checking them against the device
};

/// Makes a plan. Throws Error(Arguments) for names and knobs that do not exist, Error(Work) for .npy files that cannot
/// be read.
Plan make_plan(const PlanArgs& args);

/// Returns the votes that a method takes, its default first; empty if its lanes do not vote.
std::vector<std::string> votes_of(const Method& method);

/// Returns the label of an entry, such as "packet(sum)", "stack-max(11)", "cut(0.25,sum)" or "cut(best)". It holds the
/// threshold, if that is a count or not the standard one; the vote, if the method has no threshold or the vote is not
/// its first one; and the other knobs.
std::string label_of(const Method& method, const Knobs& knobs, bool best);

}  // namespace ballot::bench
