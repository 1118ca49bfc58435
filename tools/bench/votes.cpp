#include "tools/bench/votes.h"

#include <sstream>

namespace ballot::bench {

namespace {

std::string vote_of(const Cell& cell) {
  const auto vote = cell.first().knobs.find("vote");
  return vote == cell.first().knobs.end() ? "" : vote->second;
}

/// Returns the label without the vote. Entries with equal results differ only in their vote; "(best)" ones also in the
/// threshold that was best for it.
std::string kin_of(const Cell& cell) {
  const std::size_t open = cell.label.find('(');
  if (open == std::string::npos || !cell.label.ends_with(')')) return cell.label;
  std::string parts;
  std::istringstream inner(cell.label.substr(open + 1, cell.label.size() - open - 2));
  for (std::string part; std::getline(inner, part, ',');)
    if (part != vote_of(cell)) parts += (parts.empty() ? "" : ",") + part;
  return cell.label.substr(0, open) + (parts.empty() ? "" : "(" + parts + ")");
}

}  // namespace

std::vector<VotePair> vote_pairs(const Setting& setting) {
  std::vector<VotePair> pairs;
  for (const Block& block : setting.blocks)
    for (const Cell& a : block.cells)
      for (const Cell& b : block.cells) {
        if (&a == &b || vote_of(a).empty() || vote_of(b).empty() || vote_of(a) == vote_of(b)) continue;
        if (kin_of(a) != kin_of(b)) continue;
        if (const auto ratio = time_ratio(b, a))
          pairs.push_back({&block, kin_of(a), a.role, vote_of(a), vote_of(b), *ratio});
      }
  return pairs;
}

}  // namespace ballot::bench
