// A kernel variant: method x nearest or any x numeric mode x kernel configuration, and the tuning table that fills the last.
#pragma once

#include <string>

#include "engine/oracle/oracle.h"
#include "engine/trace/methods.h"
#include "engine/trace/numeric.h"
#include "engine/vk/kernel.h"

namespace ballot {

/// Of kernels that make the camera's rays instead of reading rays: its kind.
enum class CameraKind { None, Perspective, Orthographic };

struct Variant {
  const Method* method;
  const NumericMode* numeric;
  Want want;
  KernelConfig how;
  bool counters = false;  // the instrumented variant, which also writes RayStats
  CameraKind camera = CameraKind::None;
  bool indirect = false;  // the ray count is read from IndirectArgs on the device

  std::uint32_t rays_per_lane() const { return method->wide ? how.rays : 1; }

  /// The kernel's one name: pipeline, log line, cache label. "packet.nearest.watertight [vote=...]".
  std::string kernel_name() const;
  /// The same with the threshold, which is no part of the kernel: benchmark row, EXR attribute.
  std::string name() const;
};

/// The kernel configuration for a method and a numeric mode on a device: what the method wants of this class of devices, corrected
/// by the rows of the tuning table for its driver and version, by the knobs, and by what the device lacks. Throws
/// Error(Arguments) for knobs that this device cannot follow.
KernelConfig kernel_config_for(const Method& method, const NumericMode& numeric, const DeviceInfo& device,
                               const Knobs& knobs = {});

/// Entries of the stacks that a tree needs: a walk pushes at most `pushed` per inner node on its path, above one sentinel. In
/// steps of 16, so that scenes of like depth share pipelines.
std::uint32_t stack_entries(const TreeFacts& tree, std::uint32_t pushed = 1);

/// False: every leaf holds one triangle, so kernels have no loop over them.
inline bool leaves_loop(const TreeFacts& tree) { return tree.largest_leaf != 1; }

/// Defines and specialisation constants of a variant for a tree; nothing else makes them. Throws Error(Work) if the stacks do
/// not fit the device's shared memory at the smallest workgroup.
KernelSource kernel_source(const Variant& variant, const DeviceInfo& device, const TreeFacts& tree);

}  // namespace ballot
