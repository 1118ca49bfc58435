#include "engine/answer/counters.h"

#include <algorithm>

#include "engine/core/error.h"

namespace ballot {

namespace {
double ratio(std::uint64_t a, std::uint64_t b) { return b ? double(a) / double(b) : 0; }
}  // namespace

void Counters::add(std::span<const RayStats> stats) {
  rays += stats.size();
  for (const RayStats& s : stats) {
    for (std::size_t i = 0; i < std::size(kCounters); ++i) sums[i] += s.*kCounters[i].field;
    stack = std::max(stack, s.stack);
  }
}

std::uint64_t Counters::operator[](std::string_view name) const {
  for (std::size_t i = 0; i < std::size(kCounters); ++i)
    if (kCounters[i].name == name) return sums[i];
  fail(Failure::Arguments, "no counter is called '{}'", name);
}

double Counters::active_lanes() const {
  const Counters& c = *this;
  return ratio(c["nodes_needed"] + c["leaves_needed"], c["steps"] * subgroup);
}

double Counters::packet_share() const { return ratio((*this)["packet_nodes"], (*this)["nodes"]); }

double Counters::coherence() const { return ratio((*this)["nodes_needed"], (*this)["nodes"]); }

}  // namespace ballot
