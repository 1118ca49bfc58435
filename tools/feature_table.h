// What a scene needs of the integrators' kernels, and what it gains that they are made for it.
#pragma once

#include "tools/cli.h"

namespace ballot::cli {

/// What the scene holds, in words: "shading normals, mirrors".
std::string feature_words(const SceneFeatures& features);

/// A line for each kernel that each integrator runs on this scene: bytes of SPIR-V, milliseconds to compile, registers where the
/// device tells. With `measure` also how much faster the integrators are than with kernels for every feature: median of
/// device times, both in turn, of the first view. Prints; returns the same as JSON.
nlohmann::json print_features(Engine& engine, bool measure);

}  // namespace ballot::cli
