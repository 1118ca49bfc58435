// The Vulkan of a program, as the engine takes it.
#pragma once

#include "engine/api/state.h"

namespace ballot::api {

/// Returns what a caller says of his device. Refers to nothing of the struct.
GivenVulkan given_vulkan(const BallotVulkan& vulkan);

}  // namespace ballot::api
