// What the device tests and the check program share: every query there is, rays, and comparison with the oracle.
#pragma once

#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "engine/ballot.h"
#include "engine/oracle/oracle.h"

namespace ballot::harness {

constexpr std::uint8_t kPattern = 0xCD;  // hits are filled with this byte before a run

/// The knobs that choose each vote of a method; one set without knobs where it does not vote.
inline std::vector<Knobs> votes_of(const Method& m) {
  std::vector<Knobs> all;
  for (const Vote v : {Vote::Any, Vote::Count, Vote::Sum})
    if (m.takes(v)) all.push_back({{"vote", std::string(vote_name(v))}});
  if (all.empty()) all.push_back({});
  return all;
}

/// Every method x vote of a numeric mode, with the kernel configuration that the tuning table gives. One vote a method
/// of a mode that needs float64: its kernels take lavapipe about a second each to compile, and votes are about boxes.
inline std::vector<Query> every_method(Want want, std::string_view numeric) {
  std::vector<Query> queries;
  for (const Method& m : kMethods)
    for (const Knobs& knobs : votes_of(m)) {
      queries.push_back({want, std::string(m.name), std::string(numeric), knobs});
      if (find_numeric(numeric).needs_float64) break;
    }
  return queries;
}

/// The modes to hold every method to on a device: all on a GPU. Kernels take lavapipe long to compile, so there `plain`
/// is tested on the older driver and `fast` on the newer one, and at subgroup sizes that are not the default the
/// default mode alone, for arithmetic does not depend on the size.
inline std::vector<NumericMode> modes_for(const DeviceInfo& d) {
  std::vector<NumericMode> modes(std::begin(kNumericModes), std::end(kNumericModes));
  if (d.is_cpu() && d.subgroup_size != 8)
    std::erase_if(modes, [](const NumericMode& m) { return m.name != kDefaultNumeric; });
  const std::string_view elsewhere = d.mesa_version() < 250000 ? "fast" : "plain";
  if (d.is_cpu()) std::erase_if(modes, [&](const NumericMode& m) { return m.name == elsewhere; });
  return modes;
}

/// Whether the i-th of many like cases is this device's to test: all on a GPU. lavapipe compiles kernels for longer
/// than they run, so there the cases are dealt out: each is tested by one of the two drivers at the default subgroup
/// size, and by one driver at one of the other two sizes.
inline bool is_dealt(const DeviceInfo& d, std::size_t i) {
  if (!d.is_cpu()) return true;
  const std::size_t driver = d.mesa_version() < 250000 ? 0 : 1;
  if (d.subgroup_size == 8) return i % 2 == driver;
  return i % 4 == driver * 2 + (d.subgroup_size < 8 ? 0 : 1);
}

/// Knob sets that move each axis of the kernel configuration once from its default, of those that methods share.
inline std::vector<Knobs> shared_formulations(const DeviceInfo& d) {
  std::vector<Knobs> all{{{"layout", "paper"}},
                         {{"fetch", "storage"}},
                         {{"fetch", "texel"}},
                         {{"stack", "private"}},
                         {{"stack", "shared"}, {"workgroup", std::to_string(std::max(32u, d.subgroup_size))}},
                         {{"push", "branch"}},
                         {{"push", "always"}},
                         {{"packet_stack", "shared"}},
                         {{"cooperative", "0"}},
                         {{"layout", "centred"}},
                         {{"layout", "compact"}},
                         {{"minmax", "builtin"}},
                         {{"minmax", "select"}},
                         {{"minmax", "integer"}},
                         {{"leaf_box", "1"}},
                         {{"padding", "ray"}},
                         {{"leaf_run", "0"}},
                         {{"leaf_run", "1"}},
                         {{"layout", "interleaved"}},
                         {{"layout", "centred"}, {"minmax", "integer"}, {"leaf_box", "1"}},
                         {{"launch", "plain"}},
                         {{"launch", "persistent"}},
                         {{"launch", "persistent"}, {"batches", "1"}},
                         {{"launch", "persistent"}, {"batches", "7"}, {"lanes", "256"}}};
  if (d.shuffle) {
    all.push_back({{"cooperative", "1"}});
    all.push_back({{"packet_stack", "lanes"}});
  }
  if (d.buffer_address) all.push_back({{"fetch", "reference"}});
  return all;
}

/// packet-wide's rays stay in their packets however they part.
inline const Knobs kNoFallback{{"rays", "1"}, {"fallback", "0"}};

/// A method as it is, and if its packets may give up, as it is when they may not.
inline std::vector<Knobs> together_too(const Method& m) {
  return m.ray_packets ? std::vector<Knobs>{Knobs{}, kNoFallback} : std::vector<Knobs>{Knobs{}};
}

/// The same for a method, of all the axes that it has.
inline std::vector<Knobs> every_formulation(const Method& m, const DeviceInfo& d) {
  std::vector<Knobs> all = shared_formulations(d);
  std::erase_if(all, [&](const Knobs& knobs) {  // axes that the method does not have
    return std::ranges::any_of(knobs, [&](const auto& knob) { return !concerns(m, knob.first, knob.second); });
  });
  if (m.ray_packets)
    for (const char* rays : {"1", "2", "4"}) all.push_back({{"rays", rays}, {"fallback", rays[0] == '2' ? "1" : "0"}});
  if (m.tree == TreeFormatId::Frontier) all.push_back({{"frontier", "32"}});
  if (format_of(m.tree).padded) all.push_back({{"padding", "tree"}});
  if (m.tree == TreeFormatId::Frontier && d.arithmetic) all.push_back({{"reduce", "integer"}});
  return all;
}

/// Every value that a search for the method's threshold tries, and the ends of its range.
inline std::vector<Knobs> every_threshold(const Method& m) {
  std::vector<Knobs> all;
  const Threshold& t = m.threshold;
  for (const double value : t.sweep) all.push_back({{std::string(t.knob), fmt::format("{}", value)}});
  if (t.unit == Threshold::Share) all.push_back({{std::string(t.knob), "0"}});
  if (t.unit == Threshold::Count) all.push_back({{std::string(t.knob), "255"}});
  if (m.lists)
    for (const char* list : {"1", "2", "64"})
      all.push_back({{"list", list}, {std::string(t.knob), "1"}, {"stack", "private"}});
  return all;
}

/// Workgroups that the device takes, at every subgroup size that it offers.
inline std::vector<Knobs> every_size(const DeviceInfo& d) {
  std::vector<Knobs> all;
  for (std::uint32_t s = d.min_subgroup_size; s <= d.max_subgroup_size; s *= 2)
    for (const std::uint32_t w : {s, 64u, 1024u}) {
      if (w % s || w > d.max_group_invocations || w > s * d.max_group_subgroups || w > d.max_group_size_x) continue;
      all.push_back({{"subgroup", std::to_string(s)}, {"workgroup", std::to_string(w)}, {"stack", "private"}});
    }
  return all;
}

inline std::size_t count_untouched(std::span<const Hit> hits) {
  Hit pattern;
  std::memset(static_cast<void*>(&pattern), kPattern, sizeof pattern);
  std::size_t n = 0;
  for (const Hit& h : hits) n += std::memcmp(&h, &pattern, sizeof h) == 0;
  return n;
}

inline std::size_t count_different(std::span<const Hit> a, std::span<const Hit> b) {
  std::size_t n = 0;
  for (std::size_t i = 0; i < a.size(); ++i) n += std::memcmp(&a[i], &b[i], sizeof(Hit)) != 0;
  return n;
}

/// A permutation that scatters neighbours: i -> (i * odd + shift) mod n, with odd coprime to n.
inline std::vector<std::size_t> scatter_order(std::size_t n) {
  std::size_t step = n / 2 + 1;
  const auto gcd = [](std::size_t a, std::size_t b) {
    while (b) std::swap(a %= b, b);
    return a;
  };
  while (n > 1 && gcd(step, n) != 1) ++step;
  std::vector<std::size_t> order(n);
  for (std::size_t i = 0; i < n; ++i) order[i] = (i * step + 17) % n;
  return order;
}

}  // namespace ballot::harness
