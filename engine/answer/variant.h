// Kernel variants (method x nearest or any hit x numeric mode x kernel configuration) and the sources that they compile
// from.
#pragma once

#include <string>

#include "engine/answer/knobs.h"
#include "engine/answer/numeric.h"
#include "engine/core/want.h"
#include "engine/gpu/kernel.h"

namespace ballot {

/// The kind of camera whose rays a kernel generates itself. None: the kernel reads its rays from a buffer.
enum class CameraKind { None, Perspective, Orthographic };

/// All that decides the code of a traversal kernel, but for the device and the tree.
struct Variant {
  const Method* method;
  const NumericMode* numeric;
  Want want;
  KernelConfig config;
  bool counters = false;  // the instrumented variant, which also writes RayStats
  CameraKind camera = CameraKind::None;
  bool indirect = false;        // the ray count is read from IndirectArgs on the device
  bool rays_in_double = false;  // rays are records of doubles (RayInDouble)

  /// Returns the variant that traces what a variant that lists rays has listed. It is of the same method, but of
  /// while-while where lanes vote on a common path.
  Variant taking() const;

  std::uint32_t rays_per_lane() const { return method->ray_packets ? config.rays : 1; }

  /// Returns the name of the kernel: "packet.nearest.watertight [vote=...]". Pipelines, log lines and cache labels have
  /// it.
  std::string kernel_name() const;
  /// Returns the kernel's name and the threshold, which is a push constant. Benchmark rows and EXR attributes have it.
  std::string name() const;
};

/// Returns the kernel configuration of a method and a numeric mode on a device. It starts with the method's defaults
/// for this class of devices. These are corrected first by the tuning table for the driver and its version, then by the
/// knobs, and last by what the device lacks. Throws Error(Arguments) for knobs that the method or the device cannot
/// follow.
KernelConfig kernel_config_for(const Method& method, const NumericMode& numeric, const DeviceInfo& device,
                               const Knobs& knobs = {});

/// Returns the number of entries that a ray's stack has for a tree. A traversal pushes at most `pushed` entries per
/// inner node on its path, above one sentinel; `spare` more are written but never read. The number is rounded up
/// to a multiple of 16, so that scenes of similar depth share pipelines.
std::uint32_t stack_entries(const TreeFacts& tree, std::uint32_t pushed = 1, std::uint32_t spare = 0);

/// Returns the number of entries that a ray's stack has in a tree over instances. In large steps, so that moving them
/// seldom asks for another kernel.
inline std::uint32_t top_entries(const TreeFacts& tree) { return (tree.top_depth + 1 + 47) / 48 * 48; }

/// Returns true if a variant's kernels read the vertices in double of a tree that has some.
inline bool reads_doubles(const Variant& v, const TreeFacts& tree) {
  return v.numeric->triangle == TRIANGLE_DOUBLE && tree.doubles;
}

/// Returns false if every leaf holds one triangle. Kernels then need no loop over the triangles of a leaf.
inline bool leaves_loop(const TreeFacts& tree) { return tree.largest_leaf != 1; }

/// Returns the kernel of a variant for a tree: its file, defines and specialisation constants. No other function makes
/// these. Throws Error(Work) if the stacks of a workgroup do not fit the device's shared memory.
KernelSource kernel_source(const Variant& variant, const DeviceInfo& device, const TreeFacts& tree);

/// Return the texts of shaders/shared/knobs.h and knobs_guard.h. They follow from the defines that kernel_source()
/// gives.
std::string knobs_header();
std::string knobs_guard();

}  // namespace ballot
