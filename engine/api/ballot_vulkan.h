// Ballot on the Vulkan of a program: its device, and the calls of a scene in its own compute shaders. The contract is
// in ballot_c_vulkan.h. A device is opened by Device(Vulkan).
#pragma once

#include <vector>

#include "ballot.h"

namespace ballot {
inline namespace v1 {

using Include = BallotInclude;                ///< what a shader takes to call a scene
using IncludeOptions = BallotIncludeOptions;  ///< which calls it makes
using Vulkan = BallotVulkan;                  ///< a program's device
using VulkanNeed = BallotVulkanNeed;          ///< what Ballot needs or uses of it

/// Returns what a program has to enable for Ballot, and what it may.
inline std::vector<VulkanNeed> vulkan_needs() {
  std::size_t count = 0;
  check(ballot_vulkan_needs(nullptr, 0, &count));
  std::vector<VulkanNeed> list(count);
  check(ballot_vulkan_needs(list.data(), list.size(), &count));
  return list;
}

/// Returns the text, the set layout and the set with which a shader of the program calls a scene that is on the
/// program's device: ballot_scene_include(). They are the scene's, until a call with it may change it. Throws
/// Error(BALLOT_ERROR_ARGUMENT) if a name is none of the calls and hooks, or the device is Ballot's own.
inline Include shader_include(const Scene& scene, const IncludeOptions& options) {
  Include made;
  check(ballot_scene_include(scene.handle(), &options, &made));
  return made;
}

}  // namespace v1
}  // namespace ballot
