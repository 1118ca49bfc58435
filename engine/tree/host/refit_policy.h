// When a tree whose triangles move is built anew.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace ballot {

/// How the tree follows triangles that have moved.
enum class UpdateMode : std::uint32_t {
  Auto,    // refitted, and built anew once that is worth it (RefitPolicy)
  Refit,   // refitted wherever its shape can stay
  Rebuild  // built anew
};

/// A row of the registry of update modes.
struct UpdateModeRow {
  UpdateMode id;
  std::string_view name;
};
inline constexpr UpdateModeRow kUpdateModes[] = {
    {UpdateMode::Auto, "auto"}, {UpdateMode::Refit, "refit"}, {UpdateMode::Rebuild, "rebuild"}};

/// Decides between a refit and a build from what both have cost, in seconds, and from what the tree's decay has cost
/// the traces. A tree decays as refits raise its cost by the SAH over that at its build; a trace is taken to last
/// longer by as much. Once the traces since the build have lost as much time as a build would have taken more than a
/// refit, the tree is built anew. So refits and decay together never cost more than about twice what the best choice in
/// hindsight does (the ski rental problem: Karlin, Manasse, Rudolph and Sleator, Competitive Snoopy Caching,
/// Algorithmica 1988).
class RefitPolicy {
 public:
  /// Tells of a build: what it took, and the tree's cost by the SAH.
  void built(double seconds, double sah);
  /// Tells of a refit in the same way.
  void refitted(double seconds, double sah);
  /// Tells how long traces and other queries took since the last call.
  void traced(double seconds);

  /// Returns true if the next update in this mode should refit the tree.
  bool wants_refit(UpdateMode mode) const {
    return mode == UpdateMode::Refit || (mode == UpdateMode::Auto && !wants_build());
  }
  /// Returns true if the next update should build the tree.
  bool wants_build() const;
  /// Returns true if the refit just told of should be followed by a build at once: traces like those before it would
  /// lose more time than the build takes.
  bool regrets_refit() const;
  /// Returns true if queries have lost more time since the last build than another one takes: the tree should be built
  /// anew before the next query, even if no triangle moves again.
  bool overdue() const { return decay() > 1 && lost_s_ >= build_s_; }

  /// Returns the cost of the tree by the SAH over that at its build; infinity if its cost is no finite number.
  double decay() const;
  /// Returns what the last build and the last refit took, in seconds; 0: there was none.
  double build_s() const { return build_s_; }
  double refit_s() const { return refit_s_.value_or(0); }

 private:
  double build_s_ = 0;
  std::optional<double> refit_s_;
  double sah_built_ = 0, sah_ = 0;
  double lost_s_ = 0;  // by traces since the build
  // Of the traces since the last update and between the two before, had the tree not decayed.
  double traced_s_ = 0, last_traced_s_ = 0;
};

}  // namespace ballot
