// The registry of traversal methods. A new method is a row here and a file under shaders/traverse/: the command line,
// the tests, the benchmark, the viewer and the manual list it without further change. A method that walks a tree of its
// own adds a row to engine/tree/formats/formats.h.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "engine/answer/kernel_config.h"
#include "engine/tree/formats/formats.h"

namespace ballot {

/// The configuration that a method starts from on a class of devices. Rows of tuning.cpp correct it for single drivers.
struct Defaults {
  Fetch fetch;
  StackPlace stack;
  Launch launch = Launch::Plain;
  Push push = Push::Branch;
};

/// The number that decides when a method changes what it does. `--knob <knob>=<value>` sets it.
/// Unit Share: a share of the subgroup's lanes, in [0, 1]. Count: a whole number from 0 to `most`.
struct Threshold {
  enum Unit { None, Share, Count };
  std::string_view knob = {};
  Unit unit = None;
  double standard = 0;
  std::string_view what = {};
  std::span<const double> sweep = {};  // the values that a search tries
  double most = 255;
};

/// The votes that a method takes: a set of bits 1 << Vote.
enum Votes : std::uint32_t {
  kNoVotes = 0,
  kCountingVotes = 1u << int(Vote::Count) | 1u << int(Vote::Sum),
  kAllVotes = kCountingVotes | 1u << int(Vote::Any),
};

// lavapipe reads and writes shared memory lane by lane and checks each index. Stacks in private memory make while-while
// 1.2 to 1.4 times as fast on 22.3.6 (Sponza and Conference; primary, ao and diffuse rays), and with pairs in 48 bytes
// 0.9, 1.1 and 1.1 times on 25.0.7. lavapipe also gives each thread an equal run of neighbouring workgroups, and some
// rays cost more than others: persistent subgroups share the rays out while they run.
inline constexpr Defaults kCpu{.fetch = Fetch::Texel, .stack = StackPlace::Private, .launch = Launch::Persistent};
inline constexpr Defaults kGpu{.fetch = Fetch::Reference, .stack = StackPlace::Private};

/// A row of the registry of traversal methods.
struct Method {
  std::string_view name;
  std::string_view kernel;  // under shaders/
  std::string_view summary;
  TreeFormatId tree = TreeFormatId::Pair;
  Votes votes = kNoVotes;    // kNoVotes: lanes never share a path
  bool own_stack = true;     // rays have stacks of their own
  bool lists = false;        // rays put nodes aside in lists of bounded length
  bool ray_packets = false;  // packets hold several rays in each lane
  bool turns = false;        // all lanes take every step; counts them by shuffles
  bool instances = true;     // has kernels for forests (engine/tree/host/forest.h)
  bool chooses = false;      // method auto: has no kernel and runs one of the others (auto/auto.h)
  Threshold threshold = {};
  Defaults cpu = kCpu, gpu = kGpu;

  /// True if its kernel needs subgroup shuffle whatever the configuration.
  constexpr bool shuffles() const { return ray_packets || turns; }
  /// Entries of a ray's stack that waiting lanes write above their top.
  constexpr std::uint32_t spare_entries() const { return turns ? 1 : 0; }
  constexpr bool packet() const { return votes != kNoVotes; }
  constexpr bool shares_stack() const { return packet() || ray_packets; }
  /// True if idle lanes take new rays while others are at work (lib/frame/refill.glsl).
  constexpr bool refills() const { return threshold.knob == "refetch"; }
  constexpr bool takes(Vote vote) const { return (votes >> int(vote) & 1) != 0; }
  /// True if a kernel with this configuration traces at least some rays one by one.
  constexpr bool falls_back(const KernelConfig& config) const { return !ray_packets || config.fallback; }
  /// True if a kernel with this configuration reads the pair tree.
  constexpr bool reads_pairs(const KernelConfig& config) const {
    const Pairs pairs = format_of(tree).pairs;
    return pairs == Pairs::Always || (pairs == Pairs::WithFallback && falls_back(config));
  }
};

namespace sweeps {
inline constexpr double kRefetch[] = {0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1};
inline constexpr double kShare[] = {0.0625, 0.125, 0.25, 0.375, 0.5, 0.75, 1};
inline constexpr double kDisagreements[] = {0, 1, 2, 4, 8, 16, 32};
inline constexpr double kStack[] = {0, 1, 3, 5, 7, 9, 11, 15};
inline constexpr double kEntries[] = {0, 1, 2, 4, 8, 16, 32, 64};
}  // namespace sweeps

inline constexpr std::string_view kAuto = "auto";

// clang-format off
inline constexpr Method kMethods[] = {
    {.name = "packet", .kernel = "traverse/packet.comp",
     .summary = "one path for the whole subgroup, chosen by vote (Vinkler 3.1)",
     .votes = kAllVotes, .own_stack = false},
    {.name = "if-if", .kernel = "traverse/if_if.comp",
     .summary = "each ray by itself, one node or one leaf per step (Vinkler 3.2)"},
    {.name = "while-while", .kernel = "traverse/while_while.comp",
     .summary = "each ray by itself, from node to node until it holds a leaf (Aila and Laine 2009)",
     .gpu = {.fetch = Fetch::Reference, .stack = StackPlace::Private, .push = Push::Always}},
    {.name = "speculative", .kernel = "traverse/speculative.comp",
     .summary = "while-while that postpones a leaf and walks on until every lane has one (Aila and Laine 2009)"},
    {.name = "dynamic-fetch", .kernel = "traverse/dynamic_fetch.comp",
     .summary = "while-while whose idle lanes take new rays (Aila, Laine and Karras 2012)",
     .threshold = {.knob = "refetch", .unit = Threshold::Share, .standard = 0.5,
                   .what = "new rays are taken when fewer lanes than this share are at work",
                   .sweep = sweeps::kRefetch},
     .gpu = {.fetch = Fetch::Reference, .stack = StackPlace::Private, .launch = Launch::Persistent}},
    {.name = "alternate", .kernel = "traverse/alternate.comp",
     .summary = "packet; where few lanes want a subtree, these walk it at once, each by itself (Vinkler 3.3)",
     .votes = kCountingVotes,
     .threshold = {.knob = "f", .unit = Threshold::Share, .standard = 0.5,
                   .what = "a node that fewer lanes than this share want is left to those lanes",
                   .sweep = sweeps::kShare}},
    {.name = "split-count", .kernel = "traverse/split_count.comp",
     .summary = "packet; after n disagreements of the lanes, every ray by itself (Vinkler 3.3)",
     .votes = kAllVotes,
     .threshold = {.knob = "n", .unit = Threshold::Count, .standard = 8,
                   .what = "disagreements of the lanes before the packet splits", .sweep = sweeps::kDisagreements,
                   .most = 1000000}},
    {.name = "stack-max", .kernel = "traverse/stack_max.comp",
     .summary = "packet; once the shared stack holds more than k nodes, every ray by itself (Vinkler 3.3)",
     .votes = kAllVotes,
     .threshold = {.knob = "k", .unit = Threshold::Count, .standard = 11,
                   .what = "entries of the shared stack before the packet splits (paper: 11 primary, 7 secondary)",
                   .sweep = sweeps::kStack}},
    {.name = "cut", .kernel = "traverse/cut.comp",
     .summary = "packet over what many lanes want; each ray puts the rest aside and walks it afterwards (Vinkler 3.3)",
     .votes = kCountingVotes, .lists = true,
     .threshold = {.knob = "f", .unit = Threshold::Share, .standard = 0.5,
                   .what = "a node that fewer lanes than this share want is put aside", .sweep = sweeps::kShare}},
    {.name = "packet-wide", .kernel = "traverse/packet_wide.comp",
     .summary = "packet of several rays per lane over an eight-wide tree, a child per lane; for coherent rays on CPUs",
     .tree = TreeFormatId::Wide8, .ray_packets = true, .instances = false},
    {.name = "frontier", .kernel = "traverse/frontier.comp",
     .summary = "lanes test nodes near the root, one each, to find where the rays enter; then each ray by itself",
     .tree = TreeFormatId::Frontier,
     .threshold = {.knob = "e", .unit = Threshold::Count, .standard = 16,
                   .what = "with more entries into the tree than this, rays start at its root",
                   .sweep = sweeps::kEntries}},
    {.name = "bvh4", .kernel = "traverse/bvh4.comp",
     .summary = "while-while over a tree of up to four children per 64-byte node (Dammertz, Hanika and Keller 2008)",
     .tree = TreeFormatId::Bvh4},
    {.name = "bvh4-turns", .kernel = "traverse/bvh4_turns.comp",
     .summary = "bvh4 with all lanes in every step: nodes and triangles take turns; idle lanes take rays; for CPUs",
     .tree = TreeFormatId::Bvh4, .turns = true,
     .threshold = {.knob = "refetch", .unit = Threshold::Share, .standard = 0.375,
                   .what = "as dynamic-fetch", .sweep = sweeps::kRefetch},
     .gpu = {.fetch = Fetch::Reference, .stack = StackPlace::Private, .launch = Launch::Persistent}},
    {.name = "bvh8", .kernel = "traverse/bvh8.comp",
     .summary = "each ray over a compressed tree of up to eight children per node (Ylitie, Karras and Laine 2017)",
     .tree = TreeFormatId::Bvh8,
     .threshold = {.knob = "refetch", .unit = Threshold::Share, .standard = 0.75,
                   .what = "as dynamic-fetch, if the launch is persistent", .sweep = sweeps::kRefetch},
     .gpu = {.fetch = Fetch::Reference, .stack = StackPlace::Private, .launch = Launch::Persistent}},
    {.name = kAuto, .kernel = "",
     .summary = "one of these, by a table of measured rows: the device, the ray class and the size of the batch decide",
     .own_stack = false, .chooses = true},
};
// clang-format on

inline constexpr std::string_view kDefaultMethod = kAuto;

/// The method for rays that other methods leave unfinished.
inline constexpr std::string_view kPlainestMethod = "while-while";

/// Returns the method of this name. Throws Error(Arguments), which lists the methods, if there is none.
const Method& find_method(std::string_view name);

}  // namespace ballot
