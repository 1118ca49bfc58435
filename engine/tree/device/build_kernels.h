// The kernels that build the tree on the device, and how they are dispatched. Internal to engine/tree/device.
#pragma once

#include <string>
#include <vector>

#include "engine/gpu/kernel.h"
#include "engine/tree/device/tree_access.h"
#include "shaders/shared/build.h"

namespace ballot {

/// Subgroups in a workgroup of every kernel except cluster.comp.
constexpr std::uint32_t kBuildSubgroups = BUILD_GROUP_SUBGROUPS;
/// Returns the subgroups in a workgroup of cluster.comp, the kernel that merges clusters.
std::uint32_t cluster_subgroups(const DeviceInfo& device);

/// What a tree is built over. Instances: the boxes in the instance records of a top-level tree
/// (shaders/shared/layout.h). The buffer of these records is then passed in place of the triangles. Each instance is a
/// leaf. TopBuilder writes the nodes.
enum class BuildOver { Triangles, Instances };
/// Returns the defines that tell a kernel which of the two it reads.
Defines over_define(BuildOver over);

/// Returns the source of shaders/build/NAME.comp for a device, at the device's own subgroup size.
KernelSource build_source(const std::string& name, const DeviceInfo& device, const Defines& defines = {},
                          std::uint32_t subgroups = kBuildSubgroups);

/// Returns the source of the kernel that writes pairs in a layout.
KernelSource write_source(const DeviceInfo& device, NodeLayout layout, Padding padding);

/// Returns the source of the kernel that writes the frontier of a tree (shaders/shared/layout.h). It reads the tree's
/// pairs in this layout.
KernelSource frontier_source(const DeviceInfo& device, NodeLayout layout);

/// Returns the sources of all kernels, in every variant.
std::vector<KernelSource> build_sources(const DeviceInfo& device);

/// Returns how many 32-bit words a key of this many bits takes.
constexpr std::uint32_t key_words(std::uint32_t bits) { return bits > 32 ? 2 : 1; }

/// Device milliseconds of the passes of a build, by name, in the order in which they ran.
using PassMs = std::vector<std::pair<std::string, double>>;

/// Returns the callback that adds the time of a pass to `ms` under `name`. Equal names that follow each other are
/// summed up.
inline Context::Done added_to(PassMs& ms, std::string name) {
  return [&ms, name = std::move(name)](double spent) {
    if (ms.empty() || ms.back().first != name)
      ms.emplace_back(name, spent);
    else
      ms.back().second += spent;
  };
}

/// Records a pass of one dispatch. `ms` gets its device time when it has ended, under `name`.
template <class P>
void record_build(Context& gpu, Kernel& kernel, std::uint32_t groups, const P& push, std::string name, PassMs& ms) {
  gpu.pass(
      kernel.name(), [&](Commands& cmd) { kernel.dispatch(cmd, groups, push); }, added_to(ms, std::move(name)));
}

}  // namespace ballot
