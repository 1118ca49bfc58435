#include "engine/answer/covering.h"

#include <optional>
#include <random>
#include <ranges>

#include "engine/core/error.h"

namespace ballot {

namespace {

constexpr std::size_t kTries = 40, kMisses = 1200;  // candidates for a place in the list; those in vain before its end
constexpr std::uint32_t kDepth = 31;                // of the trees

/// Returns the values of a knob that are tried on a device. No kernel depends on the others.
std::vector<std::string> values_of(const Knob& knob, const DeviceInfo& device) {
  std::vector<std::string> values;
  for (const std::string_view name : knob.names)
    if (!name.empty()) values.emplace_back(name);
  for (const std::uint32_t number : knob.numbers)
    if (number) values.push_back(std::to_string(number));
  for (const std::uint32_t number : knob.tried)
    if (number) values.push_back(std::to_string(number));
  if (knob.name == "workgroup") values.push_back(std::to_string(device.subgroup_size));
  if (knob.name == "subgroup")
    for (std::uint32_t s = device.min_subgroup_size; s <= device.max_subgroup_size; s *= 2)
      values.push_back(std::to_string(s));
  if (knob.name == "reorder") values.clear();
  return values;
}

/// Makes random kernels.
class Maker {
 public:
  explicit Maker(const CoveringChoices& choices) : choices_(choices) {}

  /// Returns a kernel, or nothing if the settings do not go together.
  std::optional<CoveringKernel> make() {
    const Method& method = one_of(choices_.methods);
    const DeviceInfo& device = one_of(choices_.devices);
    const NumericMode& numeric = one_of(choices_.modes);
    Query query{one_of(kWants), std::string(method.name), std::string(numeric.name), {}};
    for (const Knob& knob : kKnobs) {
      const std::vector<std::string> values = values_of(knob, device);
      if (values.empty()) continue;
      const std::string& value = one_of(values);
      if (concerns(method, knob.name, value)) query.knobs.emplace(knob.name, value);
    }
    if (method.chooses || (method.shuffles() && !device.shuffle)) return {};
    try {
      CoveringKernel made{query, {&method, &numeric, query.want, {}}, &device, {}};
      made.variant.config = kernel_config_for(method, numeric, device, query.knobs);
      choose_flow(made.variant);
      made.tree = {.depth = kDepth, .largest_leaf = MAX_LEAF_TRIANGLES};
      const std::size_t kind = choices_.only_queries ? 0 : below(5);
      if (kind == 1) made.tree.largest_leaf = 1;
      if (kind == 2) made.tree.far = true;
      if (kind >= 3 && method.instances) made.tree.top_depth = 24;
      if (kind == 4 && method.instances) made.tree.large = true;
      if (numeric.triangle == TRIANGLE_DOUBLE && !choices_.only_queries) made.tree.doubles = below(2) == 1;
      made.source();  // refuses stacks that do not fit
      if (made.variant.config.lists()) kernel_source(made.variant.taking(), device, made.tree);
      return made;
    } catch (const Error&) {
      return {};
    }
  }

 private:
  static constexpr Want kWants[] = {Want::Nearest, Want::Any};

  std::size_t below(std::size_t n) { return random_() % n; }
  template <class Range>
  const std::ranges::range_value_t<const Range&>& one_of(const Range& all) {
    return all[below(std::size(all))];
  }
  void choose_flow(Variant& v) {
    const std::size_t flow = below(choices_.only_queries ? 2 : 5);
    v.counters = flow == 1;
    v.indirect = flow == 2;
    if (v.counters) v.config.doubtful = Doubtful::Decided;
    if (v.want == Want::Nearest && flow > 2) v.camera = CameraKind(flow - 2);
    if (flow == 0 && !choices_.only_queries && v.numeric->triangle == TRIANGLE_DOUBLE) v.rays_in_double = below(2) == 1;
  }

  const CoveringChoices& choices_;
  std::mt19937 random_;
};

/// The pairs of settings that a list of kernels has.
class MetPairs {
 public:
  /// Returns the numbers of a kernel's settings.
  std::vector<std::size_t> settings(const CoveringKernel& k) {
    std::vector<std::size_t> all;
    const auto add = [&](std::string text) {
      all.push_back(numbers_.emplace(std::move(text), numbers_.size()).first->second);
    };
    const KernelSource source = k.source();
    for (const auto& [name, value] : source.defines) add(fmt::format("{}={}", name, value));
    for (const Knob& knob : kKnobs)
      if (knob.define.empty() && knob.applies_to(*k.variant.method, k.variant.config))
        add(fmt::format("{}={}", knob.name, value_text(knob, k.variant.config)));
    add(k.query.method);
    add(k.query.numeric);
    add(k.device->name);
    met_.resize(numbers_.size());
    for (std::vector<bool>& row : met_) row.resize(numbers_.size());
    return all;
  }
  std::size_t count_new(std::span<const std::size_t> settings) const {
    std::size_t n = 0;
    for (const std::size_t a : settings)
      for (const std::size_t b : settings) n += !met_[a][b];
    return n;
  }
  void add(std::span<const std::size_t> settings) {
    for (const std::size_t a : settings)
      for (const std::size_t b : settings) met_[a][b] = true;
  }

 private:
  std::map<std::string, std::size_t> numbers_;
  std::vector<std::vector<bool>> met_;
};

}  // namespace

std::vector<CoveringKernel> covering_kernels(const CoveringChoices& choices) {
  std::vector<CoveringKernel> list;
  Maker maker(choices);
  MetPairs pairs;
  for (std::size_t misses = 0; misses < kMisses;) {
    std::optional<CoveringKernel> best;
    std::vector<std::size_t> of_best;
    std::size_t most = 0;
    for (std::size_t i = 0; i < kTries; ++i) {
      std::optional<CoveringKernel> made = maker.make();
      if (!made) continue;
      std::vector<std::size_t> settings = pairs.settings(*made);
      if (const std::size_t gain = pairs.count_new(settings); gain > most)
        most = gain, best = std::move(made), of_best = std::move(settings);
    }
    if (!best) {
      misses += kTries;
      continue;
    }
    misses = 0;
    pairs.add(of_best);
    list.push_back(std::move(*best));
  }
  return list;
}

}  // namespace ballot
