// Meshes of a glTF file that a scene holds once, and the instances that place them. Internal to engine/files.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "engine/files/gltf_file.h"

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

/// Fills the meshes and placements of a scene as its triangles are appended. A node has the name of the file, else that
/// of its mesh, else "node N".
class InstanceWriter {
 public:
  InstanceWriter(const GltfFile& file, Scene& scene) : file_(file), scene_(scene) {}

  /// Begins a copy of a node's mesh, whose triangles lie in the world. Copies of one node that follow one another are
  /// one mesh, so that a small file cannot ask for many.
  void begin_copy(std::size_t node);

  /// Begins a mesh of a node, which lies in the world.
  void begin_in_world(std::size_t node, ShapeKind kind);

  /// Returns the number in the scene of a mesh that is kept once. A matrix that mirrors takes the mesh `turned`: its
  /// triangles are then wound in the world as glTF has it. `append(turned)`, which appends the mesh in its own space,
  /// is called once each.
  template <class Append>
  std::uint32_t number_of(std::size_t mesh, bool turned, const Append& append) {
    const auto [entry, fresh] = numbers_.try_emplace({mesh, turned}, static_cast<std::uint32_t>(to().first.size()));
    if (fresh) {
      begin_kept(mesh);
      append(turned);
    }
    return entry->second;
  }

  /// Appends an instance of a mesh of the scene. Returns its number.
  std::uint32_t place(std::size_t node, std::uint32_t mesh, const Transform& transform);

  /// Completes the meshes. A scene that keeps none is flat.
  void finish();

 private:
  SceneInstances& to() { return scene_.instances; }
  void begin_kept(std::size_t mesh);
  std::uint32_t add_name(std::string name);
  std::uint32_t name_of(std::size_t node);

  const GltfFile& file_;
  Scene& scene_;
  std::optional<std::size_t> copied_;                              // the node of the mesh that copies go on
  std::optional<std::pair<std::size_t, std::uint32_t>> named_;     // the last node, and its name
  std::map<std::pair<std::size_t, bool>, std::uint32_t> numbers_;  // of the meshes that are kept
};

}  // namespace ballot
