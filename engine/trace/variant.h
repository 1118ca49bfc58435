// A kernel variant: method x nearest or any hit x numeric mode x kernel configuration, and what compiles it.
#pragma once

#include <string>

#include "engine/oracle/oracle.h"
#include "engine/trace/knobs.h"
#include "engine/trace/numeric.h"
#include "engine/vk/kernel.h"

namespace ballot {

/// The kind of camera whose rays a kernel generates itself; None: it reads rays from a buffer.
enum class CameraKind { None, Perspective, Orthographic };

struct Variant {
  const Method* method;
  const NumericMode* numeric;
  Want want;
  KernelConfig config;
  bool counters = false;  // the instrumented variant, which also writes RayStats
  CameraKind camera = CameraKind::None;
  bool indirect = false;  // the ray count is read from IndirectArgs on the device

  std::uint32_t rays_per_lane() const { return method->ray_packets ? config.rays : 1; }

  /// The kernel's one name: pipeline, log line, cache label. "packet.nearest.watertight [vote=...]".
  std::string kernel_name() const;
  /// The kernel's name and the threshold, which is a push constant: benchmark row, EXR attribute.
  std::string name() const;
};

/// The configuration of a method and a numeric mode on a device: the method's defaults for this class of devices,
/// corrected by the tuning table for the driver and its version, by the knobs, and by what the device lacks. Throws
/// Error(Arguments) for knobs that the method or the device cannot follow.
KernelConfig kernel_config_for(const Method& method, const NumericMode& numeric, const DeviceInfo& device,
                               const Knobs& knobs = {});

/// Entries of a ray's stack for a tree: a walk pushes at most `pushed` entries per inner node on its path, above one
/// sentinel. In steps of 16, so that scenes of similar depth share pipelines.
std::uint32_t stack_entries(const TreeFacts& tree, std::uint32_t pushed = 1);

/// False if every leaf holds one triangle: kernels then have no loop over them.
inline bool leaves_loop(const TreeFacts& tree) { return tree.largest_leaf != 1; }

/// Defines and specialisation constants of a variant for a tree; nothing else makes them. Throws Error(Work) if the
/// stacks do not fit the device's shared memory at the smallest workgroup.
KernelSource kernel_source(const Variant& variant, const DeviceInfo& device, const TreeFacts& tree);

/// The text of shaders/shared/knobs.h and knobs_guard.h, which follow from the defines that kernel_source() gives.
std::string knobs_header();
std::string knobs_guard();

}  // namespace ballot
