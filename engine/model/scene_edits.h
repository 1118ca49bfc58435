// Edits of a scene's meshes and placements, which gather until all of them are made true at once. No Vulkan.
#pragma once

#include <map>
#include <optional>

#include "engine/model/scene.h"

namespace ballot {

/// The triangles of a mesh that an edit brings.
struct MeshGeometry {
  UnsetVector<Triangle> triangles = {};             // finite
  std::vector<std::array<glm::vec3, 3>> normals{};  // unit, three a triangle; none: those of the triangles
  std::vector<Shape> shapes{};                      // that the triangles stand in for; none: they are triangles
  ShapeKind kind = ShapeKind::Triangles;
  std::size_t columns = 0;    // of the raster of heights that tells the triangles; 0: there is none
  std::size_t elsewhere = 0;  // triangles that lie on a device, without normals; `triangles` has none then

  std::size_t size() const { return elsewhere ? elsewhere : triangles.size(); }
};

/// Other meshes, or other placements, of a scene.
struct SceneStructure {
  SceneInstances instances;
  bool replaces_arrays = false;  // the arrays that follow, as in Scene, are those of the meshes; else the scene's stay
  UnsetVector<Triangle> triangles;  // of meshes that lie elsewhere: room
  std::vector<std::array<glm::vec3, 3>> normals;
  std::vector<std::uint32_t> material_of;
  std::vector<Material> materials;
  std::array<std::vector<std::array<glm::vec2, 3>>, kUvSets> uvs;
  std::vector<std::array<glm::vec4, 3>> colors;
  std::vector<Shape> shapes;
  std::vector<std::optional<std::uint32_t>> same_as;  // each mesh: that of the scene whose triangles it has
  std::vector<bool> elsewhere;                        // each mesh: its triangles lie on a device

  /// Gives a scene the structure and takes the scene's. Doing so twice leaves the scene as it was.
  void exchange(Scene& scene);
};

/// The numbers that meshes and placements of a scene get next.
struct SceneNumbers {
  std::uint32_t mesh = 0, placement = 0;
};

/// Edits of the meshes and placements of a scene, which are named by the numbers in their labels. A number is given
/// once and stays. A call that throws Error(Arguments) adds nothing to the edits. Belongs to one thread.
class SceneEdits {
 public:
  /// Keeps references. The scene is finished (finish_scene()) and must not change otherwise. Numbers that are given are
  /// gone even if the edits are dropped.
  SceneEdits(const Scene& scene, SceneNumbers& next) : scene_(scene), next_(next) {}

  /// Adds a mesh, which is placed nowhere yet, and returns its number. Without an id that is its id, without a name its
  /// name is "mesh N".
  std::uint32_t add_mesh(MeshGeometry mesh, std::optional<std::uint32_t> id, std::optional<std::string> name);
  /// Gives a mesh other triangles, any number of them. It keeps its placements, name and id.
  void replace_mesh(std::uint32_t mesh, MeshGeometry with);
  /// Gives a mesh as many other triangles, or as many other shapes and what stands in for them. It keeps all else.
  void move_mesh(std::uint32_t mesh, MeshGeometry to);
  /// Removes a mesh and its placements.
  void remove_mesh(std::uint32_t mesh);
  /// Has a mesh lie in a tree of its own from now on.
  void separate_mesh(std::uint32_t mesh);
  /// Has the structure change, though the mesh stays as it is.
  void touch_mesh(std::uint32_t mesh) { mesh_at(mesh); }

  /// Adds a placement of a mesh, which it names by its number, and returns its own number.
  std::uint32_t add_placement(const Placement& given);
  void remove_placement(std::uint32_t placement);
  void set_mask(std::uint32_t placement, std::uint32_t mask);
  void set_group(std::uint32_t placement, std::uint32_t group);
  /// Sets the masks of all placements, in the order of their numbers.
  void set_masks(std::span<const std::uint32_t> masks);
  /// Returns true if such masks change the structure, or the other edits do so: a placement is met that was not before,
  /// or the other way round.
  bool hides_or_shows(std::span<const std::uint32_t> masks) const;
  void set_transform(std::uint32_t placement, const Transform& transform);
  /// Moves all placements, in the order of their numbers. The transforms must stay until the edits are taken.
  void set_transforms(std::span<const Transform> transforms);

  /// Return the index that a mesh of this number has in the scene: none for one that an edit adds or gives other
  /// triangles. Throw Error(Arguments) if there is no such mesh, as has_mesh() tells, or placement.
  std::optional<std::uint32_t> mesh_index(std::uint32_t mesh) const;
  bool has_mesh(std::uint32_t mesh) const;
  void check_placement(std::uint32_t placement) const;
  std::size_t placement_count() const;
  /// Returns the number of the mesh of each placement, by the number of that.
  std::map<std::uint32_t, std::uint32_t> meshes_of_placements() const;

  /// Returns true if the edits are of anything but the vertices of meshes.
  bool changes_instances() const { return opened_ || !some_.empty() || !all_.empty(); }
  /// Returns true if meshes or placements come or go, lie in other trees, or have other masks or groups.
  bool changes_structure();
  /// Returns the structure that the edits make. Takes their triangles. `elsewhere`: of each mesh of the scene, whether
  /// its triangles lie on a device; none: no mesh's do. Flat normals of meshes without some are made of triangles here.
  SceneStructure structure(const std::vector<bool>& elsewhere = {});
  /// Returns true if the structure has normals.
  bool has_normals() const;
  /// Return, unless the structure changes, the transforms of all placements; none if they stay.
  std::span<const Transform> transforms();

 private:
  struct Mesh {
    MeshLabel label;
    std::optional<std::uint32_t> before;  // its index in the scene
    std::optional<MeshGeometry> made = {};
    bool moved = false;  // `made` has triangles alone; the rest is that of before
  };
  struct Place {
    Placement placement;  // of the mesh with the number, not the index
    PlacementLabel label;
  };
  void open();
  void separate_turned();
  Mesh& mesh_at(std::uint32_t mesh);
  Place& place_at(std::uint32_t placement);
  SceneInstances instances();
  void gather(SceneStructure& to) const;

  const Scene& scene_;
  SceneNumbers& next_;
  std::span<const Transform> all_;           // of all placements, if they have been set
  std::vector<Transform> own_;               // what transforms() returns, if not that
  std::map<std::uint32_t, Transform> some_;  // by number
  // Once the structure changes:
  bool opened_ = false;
  std::map<std::uint32_t, Mesh> meshes_;  // by number
  std::map<std::uint32_t, Place> places_;
  std::vector<std::string> names_;
};

}  // namespace ballot
