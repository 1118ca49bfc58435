// What a scene needs of the kernels, and what it gains that they are made for it.
#pragma once

#include "tools/cli.h"

namespace ballot::cli {

/// What the scene holds, in words: "shading normals, mirrors".
std::string feature_words(const SceneFeatures& features);

/// The kinds of its cameras: "perspective, orthographic".
std::string camera_words(const SceneFeatures& features);

/// What the stacks of the traversal are made for, and a line for each kernel that each shading and integrator runs on this
/// scene: bytes of SPIR-V, milliseconds to compile, registers where the device tells. With `measure` also how much faster they
/// are than kernels for every feature: median of device times, both in turn, of the first view. Prints; returns the same as
/// JSON: "features", "traversal", "shadings", "integrators".
nlohmann::json print_features(Engine& engine, bool measure);

}  // namespace ballot::cli
