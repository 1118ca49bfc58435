// Meshes of a glTF file that a scene holds once, and the instances that place them. Internal to engine/scene.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <utility>

#include "engine/scene/scene.h"

namespace ballot {

/// How often the nodes of a file use a mesh that they do not deform.
struct MeshUses {
  std::uint64_t triangles = 0, uses = 0;
  std::uint64_t placeable = 0;  // of the uses: is_placeable() (instances.h)
  std::array<bool, 2> made{};   // for these: the mesh as in the file, and turned
  bool moves = false;           // a clip moves one of its nodes
};
using UsesOfMeshes = std::map<std::size_t, MeshUses>;

/// Marks the meshes that are worth keeping once, by the sizes alone: those that the policy asks for. With
/// InstancePolicy::Auto these are all that take half the memory of copies at most, but none unless that saves
/// kWorthTriangles and half of the scene's `triangles`. If copies do not `fit`, these are all that take less.
void choose_kept(UsesOfMeshes& meshes, std::uint64_t triangles, bool fit, InstancePolicy policy);

/// The triangles that a scene must save for its instances to be worth their cost: rays are traced faster without.
inline constexpr std::uint64_t kWorthTriangles = 1 << 22;
/// The memory of an instance, in triangles of copies.
inline constexpr std::uint64_t kTrianglesAnInstance = 4;

/// Fills the instances of a scene as its triangles are appended. What is not kept once lies in meshes of its own, which
/// are in the world already: one for each run of such triangles.
class InstanceWriter {
 public:
  explicit InstanceWriter(Scene& scene) : scene_(scene) {}

  /// Returns the number of a mesh in the scene. A matrix that mirrors takes the mesh `turned`: its triangles are then
  /// wound in the world as glTF has it. `append(turned)`, which appends the mesh in its own space, is called once each.
  template <class Append>
  std::uint32_t number_of(std::size_t mesh, bool turned, const Append& append) {
    end_run();
    const auto [entry, fresh] = numbers_.try_emplace({mesh, turned}, static_cast<std::uint32_t>(to().first.size()));
    if (fresh) {
      to().first.push_back(scene_.triangles.size());
      append(turned);
      run_ = scene_.triangles.size();
    }
    return entry->second;
  }

  /// Appends an instance of a mesh of the scene. Returns its number.
  std::uint32_t place(std::uint32_t mesh, const Transform& transform);

  /// Completes the instances. A scene without any stays flat.
  void finish();

 private:
  SceneInstances& to() { return scene_.instances; }
  void end_run();

  Scene& scene_;
  std::size_t run_ = 0;                                            // the first triangle of the run
  std::map<std::pair<std::size_t, bool>, std::uint32_t> numbers_;  // of the meshes that are kept
};

}  // namespace ballot
