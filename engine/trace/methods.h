// Every traversal method there is. A new one is a line here and a file under shaders/traverse/: the command line,
// tests, benchmark and documents list it without further change.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "engine/trace/kernel_config.h"

namespace ballot {

/// Which data path, stack and launch a method wants on a class of devices; rows of tuning.cpp correct it for single
/// drivers.
struct Wants {
  Fetch fetch;
  StackPlace stack;
  Launch launch = Launch::Plain;
};

/// The one number that decides when a method changes what it does. `--knob <knob>=<value>` sets it.
struct Threshold {
  enum Unit { None, Share, Count };  // Share: of the subgroup's lanes, in [0, 1]. Count: a whole number
  Unit unit = None;
  std::string_view knob;
  double standard = 0;
  std::string_view what;
  double sweep[8] = {};  // what a search tries; `tried` of them
  std::size_t tried = 0;
};

/// Which votes a method takes; a set of bits 1 << Vote.
enum Votes : std::uint32_t {
  kNoVotes = 0,
  kCountingVotes = 1u << VOTE_COUNT | 1u << VOTE_SUM,
  kAllVotes = kCountingVotes | 1u << VOTE_ANY,
};

struct Method {
  std::string_view name;
  std::string_view kernel;  // under shaders/
  std::string_view summary;
  Votes votes;     // kNoVotes: lanes never share a path, and knobs vote, packet_stack and cooperative do not apply
  bool own_stack;  // rays have stacks of their own; knob stack applies
  Wants on_cpu, on_gpu;
  Threshold threshold = {};
  bool lists = false;  // rays put nodes aside in lists of bounded length; knob list applies
  bool wide = false;   // walks the wide tree with several rays in a lane; knobs rays, fallback and packet_stack apply
  bool frontier = false;  // the subgroup tests the frontier of the tree first; knobs frontier and reduce apply
  bool quads = false;     // walks the tree of four children a node; knobs layout, padding=tree and sorted do not apply
  bool chooses = false;   // has no kernel: runs what it finds fastest of the others (auto.h)

  bool packet() const { return votes != kNoVotes; }
  bool reduces() const { return frontier; }
  bool shares_stack() const { return packet() || wide; }
  bool takes(Vote vote) const { return (votes >> int(vote) & 1) != 0; }
};

// lavapipe reads and writes shared memory lane by lane with a check of the index: stacks in private memory make while-while 1.2
// to 1.4 times as fast on 22.3.6 (sponza and conference, primary, ao and diffuse rays), and with pairs in 48 bytes 0.9, 1.1 and
// 1.1 times on 25.0.7.
//
// It gives each thread an equal run of neighbouring workgroups, some of whose rays are dearer than others': persistent subgroups
// share the rays out as they go.
inline constexpr Wants kCpu{Fetch::Texel, StackPlace::Private, Launch::Persistent},
    kGpu{Fetch::Reference, StackPlace::Private};

inline constexpr std::string_view kAuto = "auto";

inline constexpr Method kMethods[] = {
    {"packet", "traverse/packet.comp", "one path for the subgroup, by vote (Vinkler 3.1)", kAllVotes, false, kCpu,
     kGpu},
    {"if-if", "traverse/if_if.comp", "each ray by itself, a node or a leaf at a time (Vinkler 3.2)", kNoVotes, true,
     kCpu, kGpu},
    {"while-while", "traverse/while_while.comp", "each ray by itself, nodes until a leaf (Aila and Laine 2009)",
     kNoVotes, true, kCpu, kGpu},
    {"speculative", "traverse/speculative.comp",
     "while-while that postpones a leaf and walks on until every lane has one (Aila and Laine 2009)", kNoVotes, true,
     kCpu, kGpu},
    {"dynamic-fetch",
     "traverse/dynamic_fetch.comp",
     "while-while whose idle lanes take new rays (Aila, Laine and Karras 2012)",
     kNoVotes,
     true,
     kCpu,
     {Fetch::Reference, StackPlace::Private, Launch::Persistent},
     {Threshold::Share,
      "refetch",
      0.5,
      "new rays are taken when fewer lanes than this share are at work",
      {0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1},
      8}},
    {"alternate",
     "traverse/alternate.comp",
     "packet; a subtree that few lanes want is walked by those alone, at once (Vinkler 3.3)",
     kCountingVotes,
     true,
     kCpu,
     kGpu,
     {Threshold::Share,
      "f",
      0.5,
      "a node that fewer lanes than this share want is left to them",
      {0.0625, 0.125, 0.25, 0.375, 0.5, 0.75, 1},
      7}},
    {"split-count",
     "traverse/split_count.comp",
     "packet; after n disagreements every ray by itself (Vinkler 3.3)",
     kAllVotes,
     true,
     kCpu,
     kGpu,
     {Threshold::Count, "n", 8, "disagreements of the lanes before the packet parts", {0, 1, 2, 4, 8, 16, 32}, 7}},
    {"stack-max",
     "traverse/stack_max.comp",
     "packet; once the shared stack holds more than k, every ray by itself (Vinkler 3.3)",
     kAllVotes,
     true,
     kCpu,
     kGpu,
     {Threshold::Count,
      "k",
      11,
      "entries of the shared stack before the packet parts; the paper: 11 for primary rays, 7 for secondary",
      {0, 1, 3, 5, 7, 9, 11, 15},
      8}},
    {"cut",
     "traverse/cut.comp",
     "packet over what many lanes want; each ray puts the rest aside and walks it afterwards (Vinkler 3.3)",
     kCountingVotes,
     true,
     kCpu,
     kGpu,
     {Threshold::Share,
      "f",
      0.5,
      "a node that fewer lanes than this share want is put aside",
      {0.0625, 0.125, 0.25, 0.375, 0.5, 0.75, 1},
      7},
     true},
    {"packet-wide",
     "traverse/packet_wide.comp",
     "packet of several rays a lane over a tree of eight children a node, a child a lane; for coherent rays on CPUs",
     kNoVotes,
     true,
     kCpu,
     kGpu,
     {},
     false,
     true},
    {"frontier",
     "traverse/frontier.comp",
     "the subgroup finds where its rays may enter the tree, a node of its top a lane; then each ray by itself",
     kNoVotes,
     true,
     kCpu,
     kGpu,
     {Threshold::Count,
      "e",
      16,
      "entries into the tree beyond which rays start at its root",
      {0, 1, 2, 4, 8, 16, 32, 64},
      8},
     false,
     false,
     true},
    {"bvh4",
     "traverse/bvh4.comp",
     "while-while over a tree of four children a node, in 64 bytes (Dammertz, Hanika and Keller 2008)",
     kNoVotes,
     true,
     kCpu,
     kGpu,
     {},
     false,
     false,
     false,
     true},
    {kAuto,
     "",
     "whichever of these is fastest on this device, scene and ray class: trials on a sample of them tell",
     kNoVotes,
     false,
     kCpu,
     kGpu,
     {},
     false,
     false,
     false,
     false,
     true},
};

inline constexpr std::string_view kDefaultMethod = kAuto;

/// Of few rays, and of what other methods leave: compiles fastest, and is never far from the best.
inline constexpr std::string_view kPlainestMethod = "while-while";

/// Throws Error(Arguments) that lists the methods there are.
const Method& find_method(std::string_view name);

}  // namespace ballot
