#include "engine/trace/kernel_config.h"

#include <charconv>
#include <cmath>
#include <vector>

#include "engine/core/error.h"
#include "engine/trace/methods.h"
#include "engine/trace/numeric.h"
#include "engine/vk/context.h"

namespace ballot {

namespace {

struct Knob {
  KnobInfo info;
  void (*set)(KernelConfig&, std::string_view value, const KnobInfo&);
};

[[noreturn]] void bad_value(const KnobInfo& knob, std::string_view value) {
  fail(Failure::Arguments, "--knob {}: '{}' is none of its values; it takes {}", knob.name, value, knob.values);
}

template <class E>
E choose(std::string_view value, const KnobInfo& knob, std::initializer_list<std::string_view> names) {
  int i = 0;
  for (std::string_view name : names) {
    if (name == value) return E(i);
    ++i;
  }
  bad_value(knob, value);
}

std::uint32_t number(std::string_view value, const KnobInfo& knob, std::uint32_t least, std::uint32_t most) {
  std::uint32_t n = 0;
  const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), n);
  if (error != std::errc() || end != value.data() + value.size() || n < least || n > most) bad_value(knob, value);
  return n;
}

double share(std::string_view value, const KnobInfo& knob) {
  double x = 0;
  const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), x);
  if (error != std::errc() || end != value.data() + value.size() || !(x >= 0 && x <= 1)) bad_value(knob, value);
  return x;
}

using F = KernelConfig;
using V = std::string_view;
using K = KnobInfo;

const Knob kKnobs[] = {
    {{"fetch", "storage, texel, reference", "how nodes and triangles are read"},
     [](F& f, V v, const K& k) {
       f.fetch = choose<Fetch>(v, k, {"storage", "texel", "reference"});
     }},
    {{"layout", "paper, interleaved, centred, compact", "how the two boxes of a pair lie in its 64 bytes, or in 48"},
     [](F& f, V v, const K& k) {
       f.layout = choose<NodeLayout>(v, k, {"paper", "interleaved", "centred", "compact"});
     }},
    {{"stack", "private, shared", "where a ray's own stack lies"},
     [](F& f, V v, const K& k) {
       f.stack = choose<StackPlace>(v, k, {"private", "shared"});
     }},
    {{"push", "branch, always", "rays by themselves: a child is stored where the stack must keep it, or in every step"},
     [](F& f, V v, const K& k) {
       f.push = choose<Push>(v, k, {"branch", "always"});
     }},
    {{"vote", "any, count, sum", "packets: how the lanes agree on the order of two children"},
     [](F& f, V v, const K& k) {
       f.vote = choose<Vote>(v, k, {"any", "count", "sum"});
     }},
    {{"packet_stack", "shared, lanes", "packets: where the shared stack lies"},
     [](F& f, V v, const K& k) {
       f.packet_stack = choose<PacketStack>(v, k, {"shared", "lanes"});
     }},
    {{"cooperative", "0, 1", "packets: four lanes load a pair and hand it round"},
     [](F& f, V v, const K& k) {
       f.cooperative = choose<int>(v, k, {"0", "1"}) != 0;
     }},
    {{"minmax", "builtin, select, integer",
      "box test: minima and maxima by functions, by comparison, or of three by bits"},
     [](F& f, V v, const K& k) {
       f.minmax = choose<MinMax>(v, k, {"builtin", "select", "integer"});
     }},
    {{"leaf_box", "0, 1", "a leaf's own box is tested again before its triangles"},
     [](F& f, V v, const K& k) {
       f.leaf_box = choose<int>(v, k, {"0", "1"}) != 0;
     }},
    {{"leaf_run", "0, 1", "rays by themselves: leaves are tested until a node comes up, or one at a time"},
     [](F& f, V v, const K& k) {
       f.leaf_run = choose<int>(v, k, {"0", "1"}) != 0;
     }},
    {{"sorted", "0, 1", "any hit, rays by themselves: the nearer child is entered first, or the left one"},
     [](F& f, V v, const K& k) {
       f.sorted = choose<int>(v, k, {"0", "1"}) != 0;
     }},
    {{"products", "split, float64, fma",
      "watertight: how the exact signs of edge functions are found; fma is wrong where fma() rounds twice"},
     [](F& f, V v, const K& k) {
       f.products = choose<Products>(v, k, {"split", "float64", "fma"});
     }},
    {{"padding", "ray, tree", "watertight: boxes are widened by each ray as far as it needs, or once, in the tree"},
     [](F& f, V v, const K& k) {
       f.padding = choose<Padding>(v, k, {"ray", "tree"});
     }},
    {{"launch", "plain, persistent", "one invocation a ray, or resident subgroups that take batches"},
     [](F& f, V v, const K& k) {
       f.launch = choose<Launch>(v, k, {"plain", "persistent"});
     }},
    {{"workgroup", "4 to 1024, a multiple of the subgroup", "invocations in a workgroup"},
     [](F& f, V v, const K& k) { f.workgroup = number(v, k, 4, 1024); }},
    {{"subgroup", "a power of two that the device offers", "invocations in a subgroup"},
     [](F& f, V v, const K& k) { f.subgroup = number(v, k, 4, 128); }},
    {{"batches", "1 to 4294967295", "persistent launch: batches that a subgroup takes in one dispatch"},
     [](F& f, V v, const K& k) { f.batches = number(v, k, 1, 0xFFFFFFFF); }},
    {{"lanes", "4 to 16777216", "persistent launch: invocations launched at most"},
     [](F& f, V v, const K& k) { f.resident_lanes = number(v, k, 4, 1u << 24); }},
    {{"k", "0 to 255", "stack-max: entries of the shared stack before the packet parts"},
     [](F& f, V v, const K& k) { f.threshold = number(v, k, 0, 255); }},
    {{"n", "0 to 1000000", "split-count: disagreements before the packet parts"},
     [](F& f, V v, const K& k) { f.threshold = number(v, k, 0, 1000000); }},
    {{"f", "0 to 1", "cut, alternate: the share of lanes that must want a node for the packet to walk it"},
     [](F& f, V v, const K& k) { f.threshold = share(v, k); }},
    {{"list", "1 to 64", "cut: nodes that a ray can put aside; the packet walks what does not fit"},
     [](F& f, V v, const K& k) { f.list = number(v, k, 1, 64); }},
    {{"rays", "1, 2, 4, 8", "packet-wide: rays in a lane"},
     [](F& f, V v, const K& k) {
       f.rays = 1u << choose<int>(v, k, {"1", "2", "4", "8"});
     }},
    {{"fallback", "0, 1", "packet-wide: rays of packets that spread over more than two octants go by themselves"},
     [](F& f, V v, const K& k) {
       f.fallback = choose<int>(v, k, {"0", "1"}) != 0;
     }},
    {{"jump", "0, 1", "packet-wide: triangles of a leaf are jumped over for rays that do not meet it, or masked"},
     [](F& f, V v, const K& k) {
       f.jump = choose<int>(v, k, {"0", "1"}) != 0;
     }},
    {{"frontier", "32, 64", "frontier: nodes that the subgroup tests"},
     [](F& f, V v, const K& k) {
       f.frontier = 32u << choose<int>(v, k, {"32", "64"});
     }},
    {{"e", "0 to 255", "frontier: entries into the tree beyond which rays start at its root"},
     [](F& f, V v, const K& k) { f.threshold = number(v, k, 0, 255); }},
    {{"reduce", "shuffle, integer", "frontier: minima over lanes by shuffles, or of integers by one instruction"},
     [](F& f, V v, const K& k) {
       f.reduce = choose<Reduce>(v, k, {"shuffle", "integer"});
     }},
    {{"refetch", "0 to 1", "dynamic-fetch: the share of lanes at work below which idle lanes take new rays"},
     [](F& f, V v, const K& k) { f.threshold = share(v, k); }},
};

}  // namespace

std::span<const KnobInfo> knobs() {
  static const std::vector<KnobInfo> all = [] {
    std::vector<KnobInfo> list;
    for (const Knob& k : kKnobs) list.push_back(k.info);
    return list;
  }();
  return all;
}

void apply_knobs(KernelConfig& config, const Knobs& knobs) {
  for (const auto& [name, value] : knobs) {
    const Knob* found = nullptr;
    std::string names;
    for (const Knob& k : kKnobs) {
      if (k.info.name == name) found = &k;
      names += fmt::format("{}{}", names.empty() ? "" : ", ", k.info.name);
    }
    if (!found) fail(Failure::Arguments, "no knob is called '{}'; there are: {}", name, names);
    found->set(config, value, found->info);
  }
}

std::string describe(const KernelConfig& f, const Method& method) {
  constexpr const char* fetches[] = {"storage", "texel", "reference"};
  constexpr const char* layouts[] = {"paper", "interleaved", "centred", "compact"};
  constexpr const char* minima[] = {"builtin", "select", "integer"};
  std::string text = fmt::format("fetch={}", fetches[int(f.fetch)]);
  if (!method.quads) text += fmt::format(" layout={}", layouts[int(f.layout)]);
  if (method.packet())
    text += fmt::format(" vote={} packet_stack={} cooperative={}", vote_name(f.vote),
                        f.packet_stack == PacketStack::Lanes ? "lanes" : "shared", int(f.cooperative));
  if (method.wide)
    text += fmt::format(" rays={} fallback={} jump={} packet_stack={}", f.rays, int(f.fallback), int(f.jump),
                        f.packet_stack == PacketStack::Lanes ? "lanes" : "shared");
  if (method.frontier) text += fmt::format(" frontier={}", f.frontier);
  if (method.reduces()) text += fmt::format(" reduce={}", f.reduce == Reduce::Integer ? "integer" : "shuffle");
  if (method.own_stack)
    text += fmt::format(" stack={} push={}", f.stack == StackPlace::Shared ? "shared" : "private",
                        f.push == Push::Always ? "always" : "branch");
  if (method.lists) text += fmt::format(" list={}", f.list);
  constexpr const char* products[] = {"split", "float64", "fma"};
  text += fmt::format(" products={}", products[int(f.products)]);
  if (!method.wide && !method.quads) text += fmt::format(" padding={}", f.padding == Padding::Tree ? "tree" : "ray");
  text += fmt::format(" minmax={} leaf_box={} leaf_run={}", minima[int(f.minmax)], int(f.leaf_box), int(f.leaf_run));
  if (!method.quads) text += fmt::format(" sorted={}", int(f.sorted));
  text += fmt::format(" launch={} workgroup={}", f.launch == Launch::Plain ? "plain" : "persistent", f.workgroup);
  if (f.launch == Launch::Persistent) text += fmt::format(" batches={} lanes={}", f.batches, f.resident_lanes);
  return text;
}

std::string describe_threshold(const KernelConfig& f, const Method& method) {
  if (method.threshold.unit == Threshold::None) return "";
  return fmt::format("{}={:.6g}", method.threshold.knob, f.threshold);
}

std::uint32_t KernelConfig::threshold_lanes(const Method& method) const {
  if (method.threshold.unit == Threshold::Share) return std::uint32_t(std::ceil(threshold * subgroup - 1e-9));
  return std::uint32_t(threshold);
}

std::string_view vote_name(Vote vote) {
  constexpr std::string_view names[] = {"any", "count", "sum"};
  return names[int(vote)];
}

const Method& find_method(std::string_view name) {
  std::string names;
  for (const Method& m : kMethods) {
    if (m.name == name) return m;
    names += fmt::format("{}{}", names.empty() ? "" : ", ", m.name);
  }
  fail(Failure::Arguments, "no traversal method is called '{}'; there are: {}", name, names);
}

const NumericMode& find_numeric(std::string_view name) {
  std::string names;
  for (const NumericMode& m : kNumericModes) {
    if (m.name == name) return m;
    names += fmt::format("{}{}", names.empty() ? "" : ", ", m.name);
  }
  fail(Failure::Arguments, "no numeric mode is called '{}'; there are: {}", name, names);
}

const NumericMode& find_numeric(std::string_view name, const DeviceInfo& device) {
  const NumericMode& mode = find_numeric(name);
  if (!mode.needs_float64 || device.float64) return mode;
  std::string others;
  for (const NumericMode& m : kNumericModes)
    if (!m.needs_float64) others += fmt::format("{}{}", others.empty() ? "" : ", ", m.name);
  fail(Failure::Arguments, "numeric mode {} needs double precision (shaderFloat64), which {} lacks; it has: {}", name,
       device.name, others);
}

}  // namespace ballot
