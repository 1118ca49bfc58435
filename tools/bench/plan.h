// What a run of `ballot bench` is to measure: the words of the command line, checked and spelled out.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/bench/document.h"

namespace ballot::bench {

/// A method with votes and knobs, under the name that tables give it.
struct Entry {
  std::string label;
  Role role = Role::Method;
  Query query;  // want is set by the rays
  std::optional<ThresholdValue> threshold;
};

/// Entries that differ in their threshold alone.
struct Sweep {
  std::string best_label;
  std::vector<Entry> entries;
};

/// The rays of one file.
struct RayFile {
  std::string view;  // empty where a set has one file; else its stem, or the path as given where two have one stem
  std::vector<Ray> rays;
};

/// A ray kind, or foreign rays: files of one name stand for the views of a scene.
struct RaySet {
  std::string name;
  const RayKind* kind = nullptr;
  std::vector<RayFile> files = {};
  Want want = Want::Nearest;
};

struct PlanArgs {
  std::string methods = "all", rays = "primary,secondary", numeric{kDefaultNumeric}, views = "all";  // lists, or "all"
  std::string views_file;          // its views stand for those of the scenes; empty: none
  std::vector<std::string> knobs;  // NAME=VALUE for every method
  bool sweep = false;
};

struct Plan {
  std::vector<Entry> entries;
  std::vector<Sweep> sweeps;
  std::vector<RaySet> rays;
  std::vector<std::string> views;  // empty: all
  std::vector<View> given_views;   // of PlanArgs::views_file

  std::vector<Query> queries() const;  // of entries and sweeps, for the device to refuse
};

/// Throws Error(Arguments) for names and knobs that do not exist, Error(Work) for .npy files that cannot be read.
Plan make_plan(const PlanArgs& args);

/// Votes that a method takes, its own choice first; none if its lanes do not vote.
std::vector<std::string> votes_of(const Method& method);

/// "packet(sum)", "stack-max(11)", "cut(0.25,sum)", "cut(best)": the vote where a method has nothing else to be told by
/// or it is not the method's first one, the threshold where it is a count or not the standard one, and other knobs.
std::string label_of(const Method& method, const Knobs& knobs, bool best);

/// The label of the like entry that votes by `count`, for labels that leave out a first vote of `any`: "stack-max(11)"
/// to "stack-max(11,count)". "" where there is none.
std::string label_by_count(const std::string& label);

}  // namespace ballot::bench
