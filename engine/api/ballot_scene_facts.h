// What a scene tells of itself in C++: its meshes, their names and attributes, its instances. ballot.h includes it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "ballot_views.h"

namespace ballot {
inline namespace v1 {

/// The part of a Scene that tells what it holds, as it was committed last.
class SceneFacts {
 public:
  /// Returns what the scene holds.
  SceneInfo info() const {
    SceneInfo info;
    check(ballot_scene_info(handle_.get(), &info));
    return info;
  }

  /// Returns the meshes, in the order of their numbers.
  std::vector<MeshInfo> meshes() const {
    std::vector<MeshInfo> all(info().meshes);
    for (std::size_t i = 0; i < all.size(); ++i) check(ballot_scene_mesh(handle_.get(), i, &all[i]));
    return all;
  }
  /// Returns the instances. A scene that was made without has one of each mesh, in the world.
  std::vector<InstanceInfo> instances() const {
    std::vector<InstanceInfo> all(info().instances);
    for (std::size_t i = 0; i < all.size(); ++i) check(ballot_scene_instance(handle_.get(), i, &all[i]));
    return all;
  }

  /// Returns nine floats for each triangle of each mesh: x y z of its vertices, in the mesh's own space.
  std::vector<float> triangles() const {
    auto all = detail::room_for<float>(9 * info().triangles);
    if (!all.empty()) check(ballot_scene_triangles(handle_.get(), all.data()));
    return all;
  }

  /// Returns the indices that a mesh, named by its number, was made with: three for each of its triangles, or none.
  std::vector<std::uint32_t> indices(std::uint32_t mesh) const {
    std::size_t count = 0;
    check(ballot_scene_indices(handle_.get(), mesh, nullptr, 0, &count));
    auto all = detail::room_for<std::uint32_t>(count);
    check(ballot_scene_indices(handle_.get(), mesh, all.data(), all.size(), &count));
    return all;
  }

  /// Returns the heights of a mesh of these, named by its number, row by row; NaN: none.
  std::vector<float> heights(std::uint32_t mesh) const {
    std::vector<float> all;
    for (const MeshInfo& info : meshes())
      if (info.mesh == mesh && info.columns)
        all = detail::room_for<float>(info.columns * (info.triangles / 2 / (info.columns - 1) + 1));
    float none = 0;  // refused
    check(ballot_scene_heights(handle_.get(), mesh, all.empty() ? &none : all.data()));
    return all;
  }

  /// Returns the numbers of the meshes of this name, in ascending order.
  std::vector<std::uint32_t> find_meshes(const std::string& name) const {
    std::size_t count = 0;
    check(ballot_scene_find_meshes(handle_.get(), name.c_str(), nullptr, 0, &count));
    std::vector<std::uint32_t> all(count);
    check(ballot_scene_find_meshes(handle_.get(), name.c_str(), all.data(), all.size(), &count));
    return all;
  }

  /// Returns the attributes of a mesh, named by its number, in the order in which they were given.
  std::vector<AttributeInfo> attributes(std::uint32_t mesh) const {
    std::vector<AttributeInfo> all;
    for (const MeshInfo& info : meshes())
      if (info.mesh == mesh) all.resize(info.attributes);
    for (std::size_t i = 0; i < all.size(); ++i) check(ballot_scene_attribute(handle_.get(), mesh, i, &all[i]));
    return all;
  }
  /// Returns the values of the attribute at a place among those of a mesh, side by side.
  std::vector<float> attribute_values(std::uint32_t mesh, std::size_t place) const {
    AttributeInfo info;
    check(ballot_scene_attribute(handle_.get(), mesh, place, &info));
    auto values = detail::room_for<float>(info.components * info.count);
    check(ballot_scene_attribute_values(handle_.get(), mesh, place, values.data()));
    return values;
  }

  /// Returns the animations of a scene that was loaded from a glTF file.
  std::vector<AnimationInfo> animations() const {
    std::size_t count = 0;
    check(ballot_scene_animations(handle_.get(), nullptr, 0, &count));
    std::vector<AnimationInfo> all(count);
    check(ballot_scene_animations(handle_.get(), all.data(), count, &count));
    return all;
  }

  /// Returns the handle of the C interface, which stays this object's.
  BallotScene* handle() const { return handle_.get(); }

 protected:
  /// Destroys the handle with it.
  using Owner = detail::Handle<BallotScene, ballot_scene_destroy>;
  SceneFacts() = default;
  Owner handle_;  ///< of the scene
};

}  // namespace v1
}  // namespace ballot
