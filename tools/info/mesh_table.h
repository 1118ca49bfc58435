// The meshes and instances of a scene, as tables and as JSON.
#pragma once

#include "tools/program/cli.h"

namespace ballot::cli {

/// Prints the first meshes of a scene, and instances unless each mesh is placed once: names, materials, ids, triangles,
/// bounds. Returns all as JSON: "materials", names; "meshes"; "instances". The bounds of an instance are those of the
/// corners of its mesh's box. `listed`: false leaves the JSON empty, which takes memory for each.
nlohmann::json print_meshes(const Scene& scene, bool listed);

}  // namespace ballot::cli
