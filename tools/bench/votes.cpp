#include "tools/bench/votes.h"

namespace ballot::bench {

namespace {

std::string vote_of(const Cell& cell) {
  const auto vote = cell.first().knobs.find("vote");
  return vote == cell.first().knobs.end() ? "" : vote->second;
}

/// Entries of one kin differ in the vote alone; of "(best)" ones also in the threshold, each vote having its own best.
std::string kin_of(const Cell& cell) {
  if (cell.role == Role::Best) return cell.first().method + "(best)";
  std::string kin = cell.first().method;
  for (const auto& [name, value] : cell.first().knobs)
    if (name != "vote") kin += (kin == cell.first().method ? "(" : ", ") + name + "=" + value;
  return kin + (kin == cell.first().method ? "" : ")");
}

}  // namespace

std::vector<VotePair> vote_pairs(const Setting& setting) {
  std::vector<VotePair> pairs;
  for (const Block& block : setting.blocks)
    for (const Cell& a : block.cells)
      for (const Cell& b : block.cells) {
        if (&a == &b || vote_of(a).empty() || vote_of(b).empty() || vote_of(a) == vote_of(b)) continue;
        if (kin_of(a) != kin_of(b)) continue;
        if (const auto ratio = time_ratio(b, a)) pairs.push_back({&block, kin_of(a), vote_of(a), vote_of(b), *ratio});
      }
  return pairs;
}

}  // namespace ballot::bench
