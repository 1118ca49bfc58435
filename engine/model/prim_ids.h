// The ids of what hits name: meshes, nodes or materials, by the number of the triangle. No Vulkan.
#pragma once

#include "engine/model/scene.h"

namespace ballot {

/// What an id of a triangle is the number of.
enum class IdSource { Mesh, Node, Material };

struct IdSourceInfo {
  std::string_view name;
  IdSource id;
  std::string_view summary;
};
inline constexpr IdSourceInfo kIdSources[] = {
    {"mesh", IdSource::Mesh, "the mesh of a glTF file, the group of an OBJ file; 0 where a file has one mesh"},
    {"node", IdSource::Node, "the node of a glTF file that places the triangle; else as mesh"},
    {"material", IdSource::Material, "the material of the triangle"},
};
inline constexpr std::string_view kDefaultIdSource = kIdSources[0].name;

/// The id of each triangle of a scene: of the mesh and the node as in the file, whatever InstancePolicy loaded it; of
/// the material as in Scene::materials. Takes 8 bytes for each range of one id, and for each placement of a scene with
/// instances. Does not refer to the scene. It stays right while placements and vertices move. Thread-safe.
class PrimIds {
 public:
  /// The scene is finished: finish_scene().
  PrimIds(const Scene& scene, IdSource source);

  /// Returns the id of a triangle. `prim` is below triangle_count() (instances.h).
  std::uint32_t at(std::uint32_t prim) const;

  /// Return what to look an id up with elsewhere: the ranges of triangles, the first of each and behind these their
  /// ids; and what is added to the number of a triangle of a placement, which wraps, to find its range.
  std::vector<std::uint32_t> ranges() const;
  std::uint32_t shift_of(std::uint32_t prim) const { return placed_.empty() ? 0 : value_at(placed_, prim); }

 private:
  struct Range {
    std::uint32_t first, value;  // of the first number in the range
  };
  static std::uint32_t value_at(const std::vector<Range>& ranges, std::uint32_t number);
  void add(std::size_t first, std::uint32_t id);

  std::vector<Range> ids_;     // by prim, or by triangle of the scene's arrays
  std::vector<Range> placed_;  // the range's first triangle, less its first prim; none: ids_ are by prim
};

}  // namespace ballot
