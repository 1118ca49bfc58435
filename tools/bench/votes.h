// Pairs of entries that differ in their vote alone.
#pragma once

#include "tools/bench/arrange.h"

namespace ballot::bench {

struct VotePair {
  const Block* block;
  std::string method;  // as its label without the vote: "packet", "cut(best)"
  Role role;
  std::string vote, base;  // the two votes
  double speed;            // with `vote` over with `base`
};

/// Every ordered pair in every block.
std::vector<VotePair> vote_pairs(const Setting& setting);

}  // namespace ballot::bench
