// Makes the tree of a scene, where its builder runs. Internal to engine/.
#pragma once

#include "engine/scene/device_scene.h"
#include "engine/tree/device/device_build.h"

namespace ballot {

/// A tree and, if the device made it and kernels can read it where it lies, what holds it there. `bvh` is then a
/// summary.
struct SceneTree {
  Bvh bvh;
  std::shared_ptr<DeviceBuild> there = {};
};

/// What is known of each mesh of a forest: its tree, but not where its triangles lie. None: nothing.
using KnownTrees = std::vector<std::optional<MeshTree>>;

/// Trees of meshes with fewer triangles are read back: each that stays on the device takes a dozen buffers and kernels
/// of its own.
inline constexpr std::size_t kLeastThere = 1 << 16;

/// Returns a tree that stays on the device as that of a mesh. `largest_triangle`: its extent along each axis.
MeshTree tree_there(std::span<const Triangle> triangles, SceneTree built, const glm::vec3& largest_triangle);

/// Builds the trees of a scene with instances that are not known, as build_mesh() does. Throws as Forest and
/// build_tree() do.
std::unique_ptr<Forest> build_forest(Context& gpu, const Scene& scene, const BuildSettings& settings, bool use_cache,
                                     const KnownTrees& known, const Progress& progress);

/// Builds the tree of triangles. use_cache: trees of the CPU's builders are kept in cache_folder(). Throws as
/// build_bvh() and DeviceBuild do.
SceneTree build_tree(Context& gpu, std::span<const Triangle> triangles, const BuildSettings& settings, bool use_cache,
                     const Progress& progress);

/// Builds the tree of triangles [first, first + count) of a scene, which lie on the device with float64. If these are
/// all it takes their buffer. Throws as DeviceBuild does.
SceneTree build_there(Context& gpu, TrianglesThere& there, std::size_t first, std::size_t count,
                      const BuildSettings& settings);

/// Builds the tree of a mesh of a scene with instances, as build_tree() does; those of large meshes alone are cached,
/// and stay on the device. Trees of the device that do not stay are made in `scratch`, which is made if it is null.
MeshTree build_mesh(Context& gpu, std::span<const Triangle> triangles, const BuildSettings& settings, bool use_cache,
                    const Progress& progress, std::unique_ptr<DeviceBuild>& scratch);

}  // namespace ballot
