// The features that a scene needs of the kernels, and the kernels that follow.
#pragma once

#include "tools/program/cli.h"

namespace ballot::cli {

/// Returns the scene's features in words, such as "shading normals, mirrors".
std::string feature_words(const SceneFeatures& features);

/// Returns the kinds of the scene's cameras, such as "perspective, orthographic".
std::string camera_words(const SceneFeatures& features);

/// Prints the size of the traversal stacks and, for each shading and integrator, a line for each kernel that it runs on
/// this scene: bytes of SPIR-V, milliseconds to compile, and registers where the driver reports them. Returns the same
/// as JSON: "features", "traversal", "shadings", "integrators".
nlohmann::json print_features(DeviceScene& world);

}  // namespace ballot::cli
