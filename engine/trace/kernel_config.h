// The axes along which one kernel source varies from device to device; not what is computed, only how.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>

#include "engine/formats/pair.h"
#include "shaders/shared/variant.h"

namespace ballot {

struct Method;

enum class Fetch : int { Storage = FETCH_STORAGE, Texel = FETCH_TEXEL, Reference = FETCH_REFERENCE };
enum class StackPlace : int { Private = STACK_PRIVATE, Shared = STACK_SHARED };
enum class Push : int { Branch = PUSH_BRANCH, Always = PUSH_ALWAYS };
enum class PacketStack : int { Shared = PACKET_STACK_SHARED, Lanes = PACKET_STACK_LANES };
enum class Vote : int { Any = VOTE_ANY, Count = VOTE_COUNT, Sum = VOTE_SUM };
std::string_view vote_name(Vote vote);  // as knob vote takes it
enum class Products : int { Split = PRODUCTS_SPLIT, Float64 = PRODUCTS_FLOAT64, Fma = PRODUCTS_FMA };
enum class MinMax : int { Builtin = MINMAX_BUILTIN, Select = MINMAX_SELECT, Integer = MINMAX_INTEGER };
enum class Reduce : int { Shuffle = REDUCE_SHUFFLE, Integer = REDUCE_INTEGER };
enum class Padding : int { Ray, Tree };
enum class Launch : int { Plain = LAUNCH_PLAIN, Persistent = LAUNCH_PERSISTENT };

struct KernelConfig {
  Fetch fetch = Fetch::Storage;
  StackPlace stack = StackPlace::Private;
  Push push = Push::Branch;  // rays by themselves: how their stack is written
  PacketStack packet_stack = PacketStack::Shared;
  Vote vote = Vote::Count;
  Launch launch = Launch::Plain;
  NodeLayout layout = NodeLayout::Interleaved;
  Products products = Products::Split;  // watertight: how differences of products are computed
  Padding padding = Padding::Ray;       // watertight: boxes are widened by each ray, or once, in the tree
  bool cooperative = false;             // packets: four lanes load a pair and shuffle it round
  bool subgroup_barrier = true;         // packets: subgroupBarrier() after shared memory; else a memory barrier alone
  MinMax minmax = MinMax::Builtin;      // box test: how minima and maxima are taken
  bool leaf_box = false;                // a leaf's own box is tested again before its triangles
  bool leaf_run = false;                // rays by themselves: leaves until a node comes up; else one at a time
  bool loops_cut = true;                // the driver may cut loops short: kernels look out for it
  bool sorted = true;                   // any hit, rays by themselves: the nearer child first; else the left one
  std::uint32_t workgroup = 64;         // invocations; a multiple of the subgroup
  std::uint32_t subgroup = 0;           // required subgroup size; 0: the device's own
  std::uint32_t batches = 0xFFFFFFFF;   // persistent: batches that a subgroup takes at most in one dispatch
  std::uint32_t resident_lanes = 1u << 18;  // persistent: invocations launched at most
  std::uint32_t rays = 1;                   // packet-wide: rays in a lane, a power of two up to 8
  bool fallback = true;                     // packet-wide: rays of packets in more than two octants go by themselves
  bool jump = true;                         // packet-wide: triangles are left out for rays that do not meet their leaf
  Reduce reduce = Reduce::Shuffle;          // frontier: how minima over lanes are found
  std::uint32_t frontier = 64;              // frontier: nodes of it, 32 or 64
  double threshold = 0;                     // of methods that have one: a share of the subgroup, or a count
  std::uint32_t list = 16;                  // methods with lists: nodes that a ray can put aside

  /// The threshold as the kernel counts: a share is rounded up to lanes of the subgroup.
  std::uint32_t threshold_lanes(const Method& method) const;
};

/// Knobs by name, as `--knob NAME=VALUE` gives them.
using Knobs = std::map<std::string, std::string>;

/// One line per knob: what it is called, what it takes, what it does.
struct KnobInfo {
  std::string_view name, values, what;
};
std::span<const KnobInfo> knobs();

/// Applies knobs to a kernel configuration. Throws Error(Arguments) that lists names or values there are.
void apply_knobs(KernelConfig& config, const Knobs& knobs);

/// "fetch=texel stack=shared ..." of all that matters to a method; everything that makes its kernel another one.
std::string describe(const KernelConfig& f, const Method& method);
/// "k=11" where a method has a threshold, else "": kernels with other thresholds are the same kernel.
std::string describe_threshold(const KernelConfig& f, const Method& method);

}  // namespace ballot
