// The kernel configuration: how a kernel computes on one device. What it computes is the query's (query.h).
#pragma once

#include <cstdint>

#include "engine/tree/device/tree_access.h"

namespace ballot {

// Values are in the order of the names in knobs.h.
enum class StackPlace { Private, Shared };
enum class Push { Branch, Always };
enum class PacketStack { Shared, Lanes };
enum class Vote { Any, Count, Sum };
enum class Products { Split, Float64, Fma };
enum class MinMax { Builtin, Select, Integer };
enum class Unpack { Half, Integer };
enum class Reduce { Shuffle, Integer };
enum class Launch { Plain, Persistent };
/// What becomes of rays whose hit is open after float32 and double (shaders/lib/frame/doubtful.glsl). Decided: the
/// kernel decides them at once. Limited: the same, but it lists rays with many decisions. Listed: it lists them all.
/// Taken: it takes them from that list, and decides them; no knob asks for that.
enum class Doubtful { Decided, Limited, Listed, Taken };

/// One value for each knob. What a knob does is said once, in its row of knobs.h; what follows from no knob has its
/// comment here.
struct KernelConfig {
  Fetch fetch = Fetch::Storage;
  NodeLayout layout = NodeLayout::Interleaved;
  StackPlace stack = StackPlace::Private;
  Push push = Push::Branch;
  Vote vote = Vote::Count;
  PacketStack packet_stack = PacketStack::Shared;
  bool cooperative = false;
  MinMax minmax = MinMax::Builtin;
  Unpack unpack = Unpack::Half;
  bool leaf_box = false;
  bool leaf_run = false;
  bool sorted = true;
  bool reorder = false;
  Products products = Products::Split;
  Padding padding = Padding::Ray;
  Doubtful doubtful = Doubtful::Decided;
  Launch launch = Launch::Plain;
  std::uint32_t workgroup = 64;
  std::uint32_t subgroup = 0;  // 0: the device's own size
  std::uint32_t batches = 0xFFFFFFFF;
  std::uint32_t claim = 1;
  std::uint32_t resident_lanes = 1u << 18;
  std::uint32_t list = 16;
  std::uint32_t rays = 1;
  bool fallback = true;
  bool jump = true;
  Reduce reduce = Reduce::Shuffle;
  double threshold = 0;  // for methods that have one (Threshold in methods.h): a share of the subgroup, or a count
  /// Set for the driver: subgroupBarrier() follows writes to shared memory. False: a memory barrier alone.
  bool subgroup_barrier = true;
  /// Set for the driver: it may end loops early, so kernels check that their loops ran to the end.
  bool loops_cut = true;

  bool operator==(const KernelConfig&) const = default;

  /// Returns true if kernels list rays for a kernel that takes them.
  bool lists() const { return doubtful == Doubtful::Limited || doubtful == Doubtful::Listed; }
  TreeAccess tree_access() const { return {layout, padding, fetch}; }
};

}  // namespace ballot
