// Instances: meshes of a scene that lie where matrices move them. No Vulkan.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "engine/core/geometry.h"
#include "engine/model/shapes.h"

namespace ballot {

inline constexpr std::uint32_t kMeetsAll = 0xFFFFFFFF;
inline constexpr std::uint32_t kSharedGroup = 0xFFFFFFFF;  // of what questions of all groups meet

/// A mesh and where it lies.
struct Placement {
  std::uint32_t mesh = 0;
  Transform transform = {};
  std::uint32_t mask = kMeetsAll;      // rays whose masks share no bit with it do not cross it; 0: no query meets it
  std::uint32_t group = kSharedGroup;  // questions of other groups leave it out
};

/// The largest number of triangles, counted through the instances. Hit::prim has 32 bits, and two of its values mean
/// something else.
inline constexpr std::uint64_t kMostPrims = 0xFFFFFFFDull;

/// MeshLabel::material of a mesh whose triangles have several materials, or that has none.
inline constexpr std::uint32_t kSeveralMaterials = 0xFFFFFFFF;

/// What a mesh is called, and what it is.
struct MeshLabel {
  std::uint32_t name = 0;  // of SceneInstances::names
  /// The number of the mesh, or of an OBJ group, in its file. Ranges and copies of one mesh have the same id.
  std::uint32_t id = 0;
  std::uint32_t material = kSeveralMaterials;  // of all its triangles; finish_scene() sets it
  /// Its triangles lie in the world: it is placed once, with the identity. It may share a tree with others.
  bool in_world = false;
  std::uint32_t number = 0;  // by which callers name it; finish_scene() sets it
  /// What it is made of. A mesh of shapes has a tree of its own.
  ShapeKind kind = ShapeKind::Triangles;
  std::size_t columns = 0;  // of the raster of heights that tells its triangles; 0: there is none

  std::size_t rows(std::size_t triangles) const { return triangles / 2 / (columns - 1) + 1; }  // of that raster
};

/// What a placement is called.
struct PlacementLabel {
  std::uint32_t name = 0;    // of SceneInstances::names
  std::uint32_t node = 0;    // its node in the file; where a file has no nodes, the id of the mesh
  std::uint32_t number = 0;  // by which callers name it; finish_scene() sets it
};

/// Which meshes lie in one tree.
enum class Layout { Auto, Merge, Separate };

struct LayoutInfo {
  std::string_view name;
  Layout id;
  std::string_view summary;
};
inline constexpr LayoutInfo kLayouts[] = {
    {"auto", Layout::Auto,
     "one tree over the meshes that the scene is made with and that nobody has placed; else as separate"},
    {"merge", Layout::Merge, "one tree over the meshes that are placed once, by the identity, in their order"},
    {"separate", Layout::Separate, "a tree for each mesh"},
};
inline constexpr std::string_view kDefaultLayout = kLayouts[0].name;

/// The meshes of a scene, and where they lie. Every finished scene has some: finish_scene() makes one mesh of a scene
/// that is built in memory and names none.
struct SceneInstances {
  /// The first triangle of each mesh in the arrays of the scene, and behind these their end. A mesh lies in its own
  /// space, which may be the world, and is there once. Its vertices are its corners, three a triangle.
  std::vector<std::size_t> first;
  std::vector<MeshLabel> mesh_labels;  // of each mesh
  /// Hits number the triangles of the first instance first, then those of the second, and so on, as if the scene were
  /// made of moved copies.
  std::vector<Placement> placements;
  bool placed = false;                           // the maker tells all placements, of which there may be none
  std::vector<PlacementLabel> placement_labels;  // of each placement
  std::vector<std::string> names;                // as in the file: any text, any number of times
  Layout layout = Layout::Auto;
  bool numbered = false;  // labels have numbers, in ascending order; else finish_scene() gives them theirs
  /// The number of meshes that do not lie in the world. 0: the scene is flat, so its meshes are placed in their order.
  std::size_t kept = 0;

  std::size_t meshes() const { return first.empty() ? 0 : first.size() - 1; }
  std::size_t triangles_of(std::size_t mesh) const { return first[mesh + 1] - first[mesh]; }
  const std::string& mesh_name(std::size_t mesh) const { return names[mesh_labels[mesh].name]; }
  const std::string& placement_name(std::size_t placement) const { return names[placement_labels[placement].name]; }
};

/// What a loader does with a mesh that its file uses several times.
enum class InstancePolicy { Auto, Keep, Copy };

struct InstancePolicyInfo {
  std::string_view name;
  InstancePolicy id;
  std::string_view summary;
};
inline constexpr InstancePolicyInfo kInstancePolicies[] = {
    {"auto", InstancePolicy::Auto, "as keep where that saves 4 million triangles and half of the scene's"},
    {"keep", InstancePolicy::Keep, "a mesh that is used several times, or moves as a whole, is there once"},
    {"copy", InstancePolicy::Copy, "each use of a mesh is a moved copy of its triangles"},
};
inline constexpr std::string_view kDefaultInstances = kInstancePolicies[0].name;

}  // namespace ballot
