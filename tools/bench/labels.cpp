#include "tools/bench/plan.h"

namespace ballot::bench {

std::vector<std::string> votes_of(const Method& method) {
  std::vector<std::string> votes;
  for (const Vote vote : {Vote::Any, Vote::Count, Vote::Sum})
    if (method.takes(vote)) votes.emplace_back(vote_name(vote));
  return votes;
}

std::string label_of(const Method& method, const Knobs& knobs, bool best) {
  const bool has_threshold = method.threshold.unit != Threshold::None;
  std::vector<std::string> parts;
  if (has_threshold) {
    const auto given = knobs.find(std::string(method.threshold.knob));
    const std::string standard = fmt::format("{:g}", method.threshold.standard);
    const std::string value = given == knobs.end() ? standard : given->second;
    if (best)
      parts.emplace_back("best");
    else if (method.threshold.unit == Threshold::Count || value != standard)
      parts.push_back(value);
  }
  const auto vote = knobs.find("vote");
  if (vote != knobs.end() && (!has_threshold || vote->second != votes_of(method).front()))
    parts.push_back(vote->second);
  for (const auto& [name, value] : knobs)
    if (name != "vote" && name != method.threshold.knob) parts.push_back(name + "=" + value);
  if (parts.empty()) return std::string(method.name);
  return fmt::format("{}({})", method.name, fmt::join(parts, ","));
}

}  // namespace ballot::bench
