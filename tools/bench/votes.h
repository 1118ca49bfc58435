// Pairs of entries that differ only in their vote or, if "(best)", also in the threshold that was best for it.
#pragma once

#include "tools/bench/arrange.h"

namespace ballot::bench {

struct VotePair {
  const Block* block;
  std::string method;  // the label without the vote: "packet", "cut(best)"
  Role role;
  std::string vote, base;  // the two votes
  double speed;            // speed with `vote` divided by speed with `base`
};

/// Returns every ordered pair with a common view in every block.
std::vector<VotePair> vote_pairs(const Setting& setting);

}  // namespace ballot::bench
