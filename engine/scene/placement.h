// Instances: meshes of a scene that lie where matrices move them. No Vulkan.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

namespace ballot {

/// The transform of an instance: world = m[r][0] x + m[r][1] y + m[r][2] z + m[r][3] for r = 0, 1, 2. Row by row.
struct Transform {
  float m[3][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}};
};
static_assert(sizeof(Transform) == 48);

/// A mesh and where it lies.
struct Placement {
  std::uint32_t mesh = 0;
  Transform transform;
};

/// The largest number of triangles, counted through the instances. Hit::prim has 32 bits, and two of its values mean
/// something else.
inline constexpr std::uint64_t kMostPrims = 0xFFFFFFFDull;

/// The instances of a scene. A scene without placements is flat: its triangles lie in the world.
struct SceneInstances {
  /// The first triangle of each mesh in the arrays of the scene, and behind these their end. A mesh lies in its own
  /// space, and is there once.
  std::vector<std::size_t> first;
  /// Hits number the triangles of the first instance first, then those of the second, and so on, as if the scene were
  /// made of moved copies.
  std::vector<Placement> placements;

  std::size_t meshes() const { return first.empty() ? 0 : first.size() - 1; }
  std::size_t triangles_of(std::size_t mesh) const { return first[mesh + 1] - first[mesh]; }
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
