// Helpers that the device tests and ballot_check share: lists of all queries and knobs, and comparisons of hits.
#pragma once

#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "engine/answer/covering.h"
#include "engine/oracle/oracle.h"
#include "engine/scene/device_scene.h"

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

/// Returns false on lavapipe at subgroup sizes other than its own, where the costly tests are fewer.
inline bool at_default_size(const DeviceInfo& d) { return !d.is_cpu() || d.subgroup_size == 8; }

/// Returns the modes in which a device tests every method: all, but the default alone on lavapipe at subgroup sizes
/// other than its own, as arithmetic does not depend on the size and kernels take long to compile.
inline std::vector<NumericMode> modes_for(const DeviceInfo& d) {
  std::vector<NumericMode> modes(std::begin(kNumericModes), std::end(kNumericModes));
  if (!at_default_size(d)) std::erase_if(modes, [](const NumericMode& m) { return m.name != kDefaultNumeric; });
  return modes;
}

/// Returns true if this device tests the i-th of many similar cases. On lavapipe each is tested at the default subgroup
/// size, and at one of the other two.
inline bool is_dealt(const DeviceInfo& d, std::size_t i) {
  return at_default_size(d) || i % 2 == (d.subgroup_size < 8 ? 0 : 1);
}

/// The knobs with which packet-wide keeps all rays in their packets, however far the rays spread.
inline const Knobs kNoFallback{{"rays", "1"}, {"fallback", "0"}};

/// Returns an empty set of knobs and, for a method whose packets may fall back to single rays, also kNoFallback.
inline std::vector<Knobs> together_too(const Method& m) {
  return m.ray_packets ? std::vector<Knobs>{Knobs{}, kNoFallback} : std::vector<Knobs>{Knobs{}};
}

/// Returns queries of these methods in which any two settings meet that the device has (engine/answer/covering.h).
/// fma() is left out where it may round twice, and modes whose kernels take lavapipe long to compile on that.
inline std::vector<CoveringKernel> any_two_settings(std::span<const Method> methods, const DeviceInfo& d) {
  static const std::vector<NumericMode> modes = [&] {
    std::vector<NumericMode> some(std::begin(kNumericModes), std::end(kNumericModes));
    std::erase_if(some, [&](const NumericMode& m) { return d.is_cpu() && m.needs_float64; });
    return some;
  }();
  std::vector<CoveringKernel> all =
      covering_kernels({.methods = methods, .modes = modes, .devices = {&d, 1}, .only_queries = true});
  for (CoveringKernel& k : all) {
    const auto products = k.query.knobs.find("products");
    const bool rounds_once = kernel_config_for(*k.variant.method, *k.variant.numeric, d).products == Products::Fma;
    if (products != k.query.knobs.end() && products->second == "fma" && !rounds_once) k.query.knobs.erase(products);
  }
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
/// The number of hits of other primitives.
inline std::size_t count_other_prims(std::span<const Hit> a, std::span<const Hit> b) {
  std::size_t n = 0;
  for (std::size_t i = 0; i < a.size(); ++i) n += a[i].prim != b[i].prim;
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
