// The registry of knobs. A knob is a row here and a field of KernelConfig: parsing, the names of kernels, the defines
// of shaders and their guard (shaders/shared/knobs_guard.h), the tests, `--help` and the manual follow from the row.
// The threshold of a method is a knob as well; it stands in the method's own row (methods.h).
#pragma once

#include <array>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "engine/answer/methods.h"

namespace ballot {

/// Knobs by name, as `--knob NAME=VALUE` gives them.
using Knobs = std::map<std::string, std::string>;

/// Reads and writes one field of a kernel configuration. A choice is the index of its name, a flag is 0 or 1.
struct KnobField {
  double (*get)(const KernelConfig&);
  void (*set)(KernelConfig&, double);
};

template <auto Member>
constexpr KnobField field() {
  using T = std::remove_reference_t<decltype(std::declval<KernelConfig&>().*Member)>;
  return {[](const KernelConfig& config) {
            if constexpr (std::is_enum_v<T>)
              return double(int(config.*Member));
            else
              return double(config.*Member);
          },
          [](KernelConfig& config, double value) {
            if constexpr (std::is_enum_v<T>)
              config.*Member = T(int(value));
            else if constexpr (std::is_same_v<T, bool>)
              config.*Member = value != 0;
            else
              config.*Member = T(value);
          }};
}

/// A row of the registry of knobs.
struct Knob {
  std::string_view name;
  std::string_view help;
  KnobField field;
  // The values that the knob takes: one of `names`, one of `numbers`, a share in [0, 1], or a whole number from `least`
  // to `most`.
  std::array<std::string_view, 4> names = {};
  std::array<std::uint32_t, 4> numbers = {};
  bool share = false;
  double least = 0, most = 1;
  std::array<std::uint32_t, 4> tried = {};  // numbers within the limits that a list by pairs tries (covering.h)
  std::string_view takes = {};              // the values as help shows them, where the limits say too little
  /// The define that carries the value to the shader. Empty: there is none.
  std::string_view define = {};
  int idle = 0;  // the define's value where the knob does not apply
  /// Returns true if the knob changes what a method does. Null: it always does.
  bool (*applies)(const Method&, const KernelConfig&) = nullptr;
  /// The end of the message "method M ...", which refuses the knob where it does not apply. Empty: it is ignored there,
  /// except for padding=tree (tuning.cpp).
  std::string_view without = {};
  bool named = true;  // the kernel's name has its value

  bool applies_to(const Method& method, const KernelConfig& config) const {
    return !applies || applies(method, config);
  }
};

constexpr std::array<std::string_view, 4> kOffOn{"0", "1"};

constexpr bool has_own_stack(const Method& m, const KernelConfig& c) { return m.own_stack && m.falls_back(c); }
constexpr bool has_packets(const Method& m, const KernelConfig&) { return m.packet(); }
constexpr bool has_ray_packets(const Method& m, const KernelConfig&) { return m.ray_packets; }
constexpr bool has_shared_stack(const Method& m, const KernelConfig&) { return m.shares_stack(); }
constexpr bool has_frontier(const Method& m, const KernelConfig&) { return m.tree == TreeFormatId::Frontier; }
constexpr bool has_pairs(const Method& m, const KernelConfig&) { return format_of(m.tree).pairs != Pairs::Never; }
constexpr bool has_order(const Method& m, const KernelConfig& c) {
  return has_pairs(m, c) || m.tree == TreeFormatId::Bvh8;
}
constexpr bool has_byte_boxes(const Method& m, const KernelConfig&) { return m.tree == TreeFormatId::Bvh8; }
constexpr bool has_padding(const Method& m, const KernelConfig&) { return format_of(m.tree).padded; }
constexpr bool has_lists(const Method& m, const KernelConfig&) { return m.lists; }
constexpr bool is_persistent(const Method&, const KernelConfig& c) { return c.launch == Launch::Persistent; }
/// Returns true if idle lanes take new rays, and rays that a subgroup has claimed are traced for sure.
constexpr bool claims(const Method& m, const KernelConfig& c) {
  return c.launch == Launch::Persistent && !c.loops_cut && m.refills();
}

// clang-format off
inline constexpr Knob kKnobs[] = {
    {.name = "fetch",
     .help = "how nodes and triangles are read: storage buffers, texel buffers, or buffer device addresses",
     .field = field<&KernelConfig::fetch>(), .names = {"storage", "texel", "reference"}, .define = "BALLOT_FETCH"},
    {.name = "layout",
     .help = "how the two boxes of a node pair lie in its 64 bytes (compact: 48)",
     .field = field<&KernelConfig::layout>(), .names = {"paper", "interleaved", "centred", "compact"},
     .define = "BALLOT_LAYOUT", .idle = LAYOUT_CENTRED, .applies = has_pairs,
     .without = "walks a tree that has one layout only"},
    {.name = "vote",
     .help = "packets: how the lanes agree on the order of two children",
     .field = field<&KernelConfig::vote>(), .names = {"any", "count", "sum"}, .define = "BALLOT_VOTE",
     .applies = has_packets, .without = "has no packets whose lanes vote"},
    {.name = "packet_stack",
     .help = "packets: the shared stack lies in shared memory, or in registers spread over the lanes",
     .field = field<&KernelConfig::packet_stack>(), .names = {"shared", "lanes"}, .define = "BALLOT_PACKET_STACK",
     .applies = has_shared_stack},
    {.name = "cooperative",
     .help = "packets: four lanes load a node pair and pass it to the others",
     .field = field<&KernelConfig::cooperative>(), .names = kOffOn, .define = "BALLOT_COOPERATIVE",
     .applies = has_packets},
    {.name = "rays",
     .help = "packet-wide: rays per lane",
     .field = field<&KernelConfig::rays>(), .numbers = {1, 2, 4, 8}, .define = "BALLOT_RAYS", .idle = 1,
     .applies = has_ray_packets, .without = "has no packets of several rays in a lane"},
    {.name = "fallback",
     .help = "packet-wide: packets that spread over more than two octants, or meet every box, are traced ray by ray",
     .field = field<&KernelConfig::fallback>(), .names = kOffOn, .define = "BALLOT_FALLBACK",
     .applies = has_ray_packets, .without = "has no packets of several rays in a lane"},
    {.name = "jump",
     .help = "packet-wide: rays that miss a leaf's box branch around its triangles (1) or are masked (0)",
     .field = field<&KernelConfig::jump>(), .names = kOffOn, .define = "BALLOT_JUMP",
     .applies = has_ray_packets, .without = "has no packets of several rays in a lane"},
    {.name = "reduce",
     .help = "frontier: minima over the lanes are found by shuffles, or by integer reductions",
     .field = field<&KernelConfig::reduce>(), .names = {"shuffle", "integer"}, .define = "BALLOT_REDUCE",
     .applies = has_frontier, .without = "takes no minima over lanes, or takes them by shuffles on every device"},
    {.name = "stack",
     .help = "traversal ray by ray: where a ray's own stack lies",
     .field = field<&KernelConfig::stack>(), .names = {"private", "shared"}, .define = "BALLOT_STACK",
     .applies = has_own_stack},
    {.name = "push",
     .help = "traversal ray by ray: the far child is stored where needed (branch), or in every step",
     .field = field<&KernelConfig::push>(), .names = {"branch", "always"}, .define = "BALLOT_PUSH",
     .applies = has_own_stack},
    {.name = "list",
     .help = "cut: number of nodes that a ray can put aside; the packet walks nodes that do not fit",
     .field = field<&KernelConfig::list>(), .least = 1, .most = 64, .tried = {1, 16}, .applies = has_lists,
     .without = "has no lists: its rays put no nodes aside"},
    {.name = "products",
     .help = "watertight: how the exact sign of an edge function is found; fma is wrong where fma() rounds twice",
     .field = field<&KernelConfig::products>(), .names = {"split", "float64", "fma"}, .define = "BALLOT_PRODUCTS"},
    {.name = "doubtful",
     .help = "exact: which rays that double leaves open go to a kernel of their own: none, those with more than eight "
             "decisions, or all",
     .field = field<&KernelConfig::doubtful>(), .names = {"decided", "limited", "listed"}, .named = false},
    {.name = "padding",
     .help = "watertight: boxes are widened by each ray as far as it needs, or once, in the tree",
     .field = field<&KernelConfig::padding>(), .names = {"ray", "tree"}, .applies = has_padding},
    {.name = "minmax",
     .help = "box test: minima and maxima by built-in functions, by comparison, or of three integers at once",
     .field = field<&KernelConfig::minmax>(), .names = {"builtin", "select", "integer"}, .define = "BALLOT_MINMAX"},
    {.name = "unpack",
     .help = "bvh8: the bytes of boxes become floats as digits of halves, or as integers",
     .field = field<&KernelConfig::unpack>(), .names = {"half", "integer"}, .define = "BALLOT_UNPACK",
     .applies = has_byte_boxes, .without = "has no boxes whose bytes can be halves"},
    {.name = "leaf_box",
     .help = "the box of a leaf is tested again before its triangles",
     .field = field<&KernelConfig::leaf_box>(), .names = kOffOn, .define = "BALLOT_LEAF_BOX"},
    {.name = "leaf_run",
     .help = "traversal ray by ray: leaves are tested until a node comes up (1), or one at a time (0)",
     .field = field<&KernelConfig::leaf_run>(), .names = kOffOn, .define = "BALLOT_LEAF_RUN"},
    {.name = "sorted",
     .help = "any hit, traversal ray by ray: the nearer child is entered first (1), or the left one (0)",
     .field = field<&KernelConfig::sorted>(), .names = kOffOn, .define = "BALLOT_SORTED", .idle = 1,
     .applies = has_order, .without = "always enters the nearest child first"},
    {.name = "reorder",
     .help = "rays are traced in order of origin and direction (1), or as they come (0)",
     .field = field<&KernelConfig::reorder>(), .names = kOffOn, .named = false},
    {.name = "launch",
     .help = "one invocation per ray, or resident subgroups that take batches of rays from a counter",
     .field = field<&KernelConfig::launch>(), .names = {"plain", "persistent"}, .define = "BALLOT_LAUNCH"},
    {.name = "workgroup",
     .help = "invocations in a workgroup",
     .field = field<&KernelConfig::workgroup>(), .least = 4, .most = 1024, .tried = {64, 1024},
     .takes = "4 to 1024, a multiple of the subgroup"},
    {.name = "subgroup",
     .help = "invocations in a subgroup",
     .field = field<&KernelConfig::subgroup>(), .least = 4, .most = 128,
     .takes = "a power of two that the device offers", .named = false},
    {.name = "batches",
     .help = "persistent launch: the most batches that a subgroup takes in one dispatch",
     .field = field<&KernelConfig::batches>(), .least = 1, .most = 4294967295, .tried = {1, 7, 64},
     .applies = is_persistent},
    {.name = "claim",
     .help = "persistent launch, idle lanes take new rays: the most claimed at once; 1: one for each idle lane",
     .field = field<&KernelConfig::claim>(), .least = 1, .most = 4096, .tried = {1, 3, 100},
     .define = "BALLOT_CLAIM", .idle = 1,
     .applies = claims},
    {.name = "lanes",
     .help = "persistent launch: the most invocations in one dispatch",
     .field = field<&KernelConfig::resident_lanes>(), .least = 4, .most = 16777216, .tried = {256, 262144},
     .applies = is_persistent},
};
// clang-format on

/// Returns the row of a knob. Throws Error(Arguments), which lists the knobs and thresholds, if there is none of this
/// name.
Knob find_knob(std::string_view name);

/// Returns the threshold of a method as a knob.
Knob knob_of(const Threshold& threshold);

/// A knob as help shows it: its name, its values, and what it does.
struct KnobInfo {
  std::string name, values, what;
};
/// Returns all knobs, then all thresholds, in the order of help.
const std::vector<KnobInfo>& knobs();

/// Returns the value of a knob in a configuration, as `--knob` takes it: "texel".
std::string value_text(const Knob& knob, const KernelConfig& config);

/// Applies knobs to a configuration. Throws Error(Arguments), which lists the names or values that exist, for an
/// unknown one.
void apply_knobs(KernelConfig& config, const Knobs& knobs);

/// Throws Error(Arguments), which gives the reason, for a knob that the method does not have.
void check_knobs(const Method& method, const KernelConfig& config, const Knobs& knobs);

/// Returns true if a method has this knob or ignores it, false if it is an error to give it on any device.
bool concerns(const Method& method, std::string_view knob, std::string_view value);

/// Returns the name of a vote as knob `vote` takes it.
std::string_view vote_name(Vote vote);

/// Returns "fetch=texel stack=shared ...", with every named knob that applies to a method. Kernels of a method
/// differ in these values.
std::string describe(const KernelConfig& config, const Method& method);
/// Returns "k=11" for a method that has a threshold, else "". Thresholds do not change the kernel.
std::string describe_threshold(const KernelConfig& config, const Method& method);
/// Returns the threshold in the kernel's unit. A share is rounded up to lanes of the subgroup.
std::uint32_t kernel_threshold(const KernelConfig& config, const Method& method);

/// Returns the defines of all knobs for a method with this configuration.
std::vector<std::pair<std::string, int>> knob_defines(const KernelConfig& config, const Method& method);

}  // namespace ballot
