// Helpers that the device tests and ballot_check share: lists of all queries and knobs, and comparisons of hits.
#pragma once

#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "engine/ballot.h"
#include "engine/oracle/oracle.h"

namespace ballot::harness {

constexpr std::uint8_t kPattern = 0xCD;  // hits are filled with this byte before a run

/// Returns a set of knobs for each vote that a method takes. For a method without votes this is one empty set.
inline std::vector<Knobs> votes_of(const Method& m) {
  std::vector<Knobs> all;
  for (const Vote v : {Vote::Any, Vote::Count, Vote::Sum})
    if (m.takes(v)) all.push_back({{"vote", std::string(vote_name(v))}});
  if (all.empty()) all.push_back({});
  return all;
}

/// Returns a query for every method x vote of a numeric mode, with the kernel configuration of the tuning table. In a
/// mode that needs float64 there is one vote per method: each kernel takes lavapipe about a second to compile, and
/// votes depend on boxes alone.
inline std::vector<Query> every_method(Want want, std::string_view numeric) {
  std::vector<Query> queries;
  for (const Method& m : kMethods)
    for (const Knobs& knobs : votes_of(m)) {
      queries.push_back({want, std::string(m.name), std::string(numeric), knobs});
      if (find_numeric(numeric).needs_float64) break;
    }
  return queries;
}

/// Returns the modes in which a device tests every method. A GPU tests all. lavapipe takes long to compile kernels, so
/// there the older driver tests `plain` and the newer one `fast`. At subgroup sizes other than the default lavapipe
/// tests the default mode alone, as arithmetic does not depend on the size.
inline std::vector<NumericMode> modes_for(const DeviceInfo& d) {
  std::vector<NumericMode> modes(std::begin(kNumericModes), std::end(kNumericModes));
  if (d.is_cpu() && d.subgroup_size != 8)
    std::erase_if(modes, [](const NumericMode& m) { return m.name != kDefaultNumeric; });
  const std::string_view elsewhere = d.mesa_version() < 250000 ? "fast" : "plain";
  if (d.is_cpu()) std::erase_if(modes, [&](const NumericMode& m) { return m.name == elsewhere; });
  return modes;
}

/// Returns true if this device tests the i-th of many similar cases. A GPU tests all. lavapipe compiles kernels for
/// longer than they run, so there the cases are dealt out. Each is tested by one of the two drivers at the default
/// subgroup size, and by one driver at one of the other two sizes.
inline bool is_dealt(const DeviceInfo& d, std::size_t i) {
  if (!d.is_cpu()) return true;
  const std::size_t driver = d.mesa_version() < 250000 ? 0 : 1;
  if (d.subgroup_size == 8) return i % 2 == driver;
  return i % 4 == driver * 2 + (d.subgroup_size < 8 ? 0 : 1);
}

/// Returns true if this device tests the i-th of the cases that every subgroup size concerns. A GPU tests all. At each
/// subgroup size each case is tested by one of lavapipe's two drivers: even cases by the older at 4 and 8 lanes and by
/// the newer at 16, odd cases the other way round.
inline bool is_dealt_at_every_size(const DeviceInfo& d, std::size_t i) {
  if (!d.is_cpu()) return true;
  const std::size_t driver = d.mesa_version() < 250000 ? 0 : 1;
  return (i + (d.subgroup_size > 8 ? 1 : 0)) % 2 == driver;
}

/// As is_dealt_at_every_size(), but at the default subgroup size both drivers test all cases.
inline bool is_dealt_at_other_sizes(const DeviceInfo& d, std::size_t i) {
  return d.subgroup_size == 8 || is_dealt_at_every_size(d, i);
}

/// Returns sets of knobs that change each part of the kernel configuration from its default, for the parts that methods
/// share.
inline std::vector<Knobs> shared_configs(const DeviceInfo& d) {
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

/// The knobs with which packet-wide keeps all rays in their packets, however far the rays spread.
inline const Knobs kNoFallback{{"rays", "1"}, {"fallback", "0"}};

/// Returns an empty set of knobs and, for a method whose packets may fall back to single rays, also kNoFallback.
inline std::vector<Knobs> together_too(const Method& m) {
  return m.ray_packets ? std::vector<Knobs>{Knobs{}, kNoFallback} : std::vector<Knobs>{Knobs{}};
}

/// Returns sets of knobs that change each part of a method's kernel configuration from its default.
inline std::vector<Knobs> every_config(const Method& m, const DeviceInfo& d) {
  std::vector<Knobs> all = shared_configs(d);
  std::erase_if(all, [&](const Knobs& knobs) {  // parts that the method does not have
    return std::ranges::any_of(knobs, [&](const auto& knob) { return !concerns(m, knob.first, knob.second); });
  });
  if (m.ray_packets)
    for (const char* rays : {"1", "2", "4"}) all.push_back({{"rays", rays}, {"fallback", rays[0] == '2' ? "1" : "0"}});
  if (m.tree == TreeFormatId::Bvh8) all.insert(all.end(), {{{"unpack", "half"}}, {{"unpack", "integer"}}});
  if (m.refills() && !kernel_config_for(m, find_numeric(kDefaultNumeric), d, {}).loops_cut)
    for (const char* claim : {"1", "3", "100"}) all.push_back({{"launch", "persistent"}, {"claim", claim}});
  if (format_of(m.tree).padded) all.push_back({{"padding", "tree"}});
  if (m.tree == TreeFormatId::Frontier && d.arithmetic) all.push_back({{"reduce", "integer"}});
  return all;
}

/// Returns every value that a search for the method's threshold tries, and the ends of the threshold's range.
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

/// Returns workgroup sizes that the device takes, at every subgroup size that it offers.
inline std::vector<Knobs> every_size(const DeviceInfo& d) {
  std::vector<Knobs> all;
  for (std::uint32_t s = d.min_subgroup_size; s <= d.max_subgroup_size; s *= 2)
    for (const std::uint32_t w : {s, 64u, 1024u}) {
      if (w % s || w > d.max_group_invocations || w > s * d.max_group_subgroups || w > d.max_group_size_x) continue;
      all.push_back({{"subgroup", std::to_string(s)}, {"workgroup", std::to_string(w)}, {"stack", "private"}});
    }
  return all;
}

/// Returns the number of hits that still have the pattern, so that no kernel has written them.
inline std::size_t count_untouched(std::span<const Hit> hits) {
  Hit pattern;
  std::memset(static_cast<void*>(&pattern), kPattern, sizeof pattern);
  std::size_t n = 0;
  for (const Hit& h : hits) n += std::memcmp(&h, &pattern, sizeof h) == 0;
  return n;
}

/// Returns the number of hits that differ in some bit. The spans have equal sizes.
inline std::size_t count_different(std::span<const Hit> a, std::span<const Hit> b) {
  std::size_t n = 0;
  for (std::size_t i = 0; i < a.size(); ++i) n += std::memcmp(&a[i], &b[i], sizeof(Hit)) != 0;
  return n;
}

/// Returns a permutation that scatters neighbours: i -> (i * step + 17) mod n, with step coprime to n.
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
