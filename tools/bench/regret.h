// How far each entry is from the best one, over scenes and ray kinds.
#pragma once

#include "tools/bench/arrange.h"

namespace ballot::bench {

/// Time of an entry over that of the fastest entry, block by block.
struct Regret {
  std::string label;
  Role role = Role::Method;
  std::map<const Block*, double> over_best;  // blocks in which it has every view that some entry has
  const Block* worst = nullptr;
  double max = 0, median = 0;
  bool everywhere = false;  // it has every block of the setting
};

/// Every entry of a setting that has a whole block, in order of appearance.
std::vector<Regret> regrets_of(const Setting& setting);

}  // namespace ballot::bench
