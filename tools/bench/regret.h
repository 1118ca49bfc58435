// The regret of each entry: its time divided by the fastest entry's, for each scene and ray kind.
#pragma once

#include "tools/bench/arrange.h"

namespace ballot::bench {

/// The time of an entry divided by that of the fastest entry, block by block.
struct Regret {
  std::string label;
  Role role = Role::Method;
  std::map<const Block*, double> over_best;  // of blocks where the entry has a value for each view
  const Block* worst = nullptr;              // the block of `max`
  double max = 0, median = 0;
  bool everywhere = false;  // the entry has a value in every block of the setting
};

/// Returns the regret of every entry that has a value in some block, in order of appearance.
std::vector<Regret> regrets_of(const Setting& setting);

}  // namespace ballot::bench
