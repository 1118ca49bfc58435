// The forest: the trees of meshes, and a top-level tree over instances of them. Uses no Vulkan.
#pragma once

#include <atomic>
#include <functional>
#include <glm/vec4.hpp>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "engine/tree/host/instance.h"

namespace ballot {

class DeviceBuild;

/// A mesh in its own space, and its tree. Copies share the tree. If a device built it and keeps it `there`, `bvh` has
/// no nodes: it is the summary.
struct MeshTree {
  std::span<const Triangle> triangles;
  std::shared_ptr<Bvh> bvh;
  MeshExtents extents;
  std::shared_ptr<DeviceBuild> there = {};
  std::span<const Shape> shapes = {};  // that the triangles stand in for; none: they are triangles
  ShapeKind kind = ShapeKind::Triangles;
};
MeshTree make_mesh_tree(std::span<const Triangle> triangles, Bvh bvh);

/// What is known of a top-level tree without its nodes.
struct TopFacts {
  std::uint32_t records = 0;         // the texel at which the records begin
  std::uint32_t root = END_OF_TREE;  // child reference; END_OF_TREE: no instance can be hit
  std::uint32_t depth = 0;           // inner nodes on the longest path
  Bounds bounds;                     // of the boxes of all instances
  double cost = 0, built_cost = 0;   // by the SAH, in nodes: now, and when it was built
  double build_s = 0;                // wall time in seconds of the last build or refit
};

/// The instances of a group, which lie below a node of their own.
struct TopGroup {
  std::uint32_t group = 0, root = END_OF_TREE;  // the root: a child reference
};

/// The top-level tree as the device reads it (shaders/shared/layout.h).
struct TopTree : TopFacts {
  std::vector<glm::uvec4> texels;  // inner nodes, then the records of the instances
  std::vector<TopGroup> groups;    // those with instances that can be hit, in ascending order; none: there are none
};

/// How instances and their triangles are numbered.
struct InstanceNumbers {
  std::vector<std::uint32_t> prims = {};  // of each, its first triangle, and their end; none: they follow one another
  std::vector<std::uint32_t> names = {};  // of each, what errors call it; none: its index
};

/// Meshes with their trees, and their instances below a top-level tree. Hits number the triangles of the first instance
/// first, then those of the second, and so on, as if the scene had been made of moved copies. Const functions may be
/// called from several threads at once.
class Forest {
 public:
  using BuildMesh = std::function<Bvh(std::span<const Triangle>)>;

  /// Builds the top-level tree over instances of meshes with their trees, which other forests may have too. Keeps
  /// references to the triangles. Throws Error(Arguments) if a placement names no mesh, as place_instance() does, or if
  /// there are too many triangles.
  Forest(std::vector<MeshTree> meshes, std::span<const Placement> placements, InstanceNumbers numbers = {});
  /// The same for triangles that the forest keeps, whose trees `build` makes. Throws what that throws, too.
  Forest(std::vector<UnsetVector<Triangle>> meshes, std::span<const Placement> placements, const BuildMesh& build);

  /// Moves the instances: one transform for each. The top-level tree is refitted, and built anew once that has raised
  /// its cost by a quarter; the trees of the meshes stay. Hits do not depend on it. If it throws, as the constructor
  /// does, nothing has changed.
  void move(std::span<const Transform> transforms);

  /// Puts another mesh in the place of one with as many triangles, and returns that. move() must follow, as instances
  /// lie elsewhere then.
  MeshTree exchange(std::size_t mesh, MeshTree with);
  /// Returns a number that differs from those of other forests, and from those of before an exchange.
  std::uint64_t exchanges() const { return exchanges_; }

  /// Returns the share of each mesh in the time that random rays are expected to take in the trees below the top level:
  /// its cost by the SAH times the area of its instances' moved boxes, as the host knew them last. Their sum is 1, or 0
  /// if nothing can be hit.
  std::vector<double> walk_shares() const;

  /// Throws Error(Arguments) if there is not one transform for each instance.
  void check_count(std::span<const Transform> transforms) const;

  /// Tells that the instances were moved elsewhere (on a device), and a top-level tree over them with these facts.
  /// The transforms are valid for move(); none: the instances stay. Instances and a tree are made here once somebody
  /// asks for them.
  void moved_elsewhere(std::span<const Transform> transforms, const TopFacts& top);
  /// The same, but the transforms are read once somebody asks for them: read(transforms) writes them.
  void moved_elsewhere(std::function<void(std::span<Transform>)> read, const TopFacts& top);

  const std::vector<MeshTree>& meshes() const { return meshes_; }
  /// Return the number of instances, and of one its mesh and the number of its first triangle.
  std::size_t size() const { return mesh_of_.size(); }
  std::uint32_t mesh_of(std::size_t instance) const { return mesh_of_[instance]; }
  std::uint32_t first_of(std::size_t instance) const { return first_of_[instance]; }
  /// Returns what errors call an instance.
  std::size_t name_of(std::size_t instance) const { return names_.empty() ? instance : names_[instance]; }
  /// Returns true if instances have groups, so that each has a part of the top-level tree. It is then held by the host.
  bool has_groups() const { return !groups_.empty(); }
  std::uint32_t group_of(std::size_t instance) const { return groups_.empty() ? kSharedGroup : groups_[instance]; }
  const std::vector<Instance>& instances() const {
    bring();
    return instances_;
  }
  const std::vector<Transform>& transforms() const {
    bring_transforms();
    return transforms_;
  }
  /// Returns the tree on the host. Its shape differs from that of a tree that was made elsewhere.
  const TopTree& top() const {
    bring();
    return top_;
  }
  /// Returns the facts of the tree that is traced.
  const TopFacts& top_facts() const { return facts_; }
  /// Returns what stands for the tree of the whole scene where only its size matters: bounds and statistics, no nodes.
  const Bvh& summary() const { return summary_; }
  /// Returns the facts that kernels are compiled for. They do not depend on the transforms, but for the depth of the
  /// top-level tree.
  TreeFacts facts() const;

  /// Returns the number of triangles, counted through all instances.
  std::uint64_t triangle_count() const;

  /// The triangle of a hit: an instance and the triangle's number in its mesh.
  struct Place {
    std::uint32_t instance, triangle;
  };
  /// Returns the place of a triangle by its number. `prim` must be one.
  Place place_of(std::uint32_t prim) const;
  /// Returns the normal of a hit on a shape in the world (normal_of_shape()); none if it is on a triangle.
  std::optional<glm::vec3> shape_normal(const Place& place, float u, float v) const;
  /// Returns a triangle in the world, moved in double precision and rounded.
  Triangle triangle(const Place& place) const;

 private:
  void place(std::span<const Placement> placements);
  void number();
  std::vector<Instance> placed(std::span<const Transform> transforms) const;
  void set(std::vector<Instance> instances, TopTree top);
  void count();
  void summarize();
  void moved(const TopFacts& top);
  void bring() const;
  void bring_transforms() const;

  std::vector<UnsetVector<Triangle>> own_;  // triangles that nobody else keeps
  std::vector<MeshTree> meshes_;
  std::vector<std::uint32_t> mesh_of_, first_of_, names_, groups_;  // of each instance
  TopFacts facts_;
  TreeFacts tree_facts_;      // of all meshes
  BvhStats sum_;              // of all meshes
  std::vector<double> sahs_;  // of each mesh
  Bvh summary_;
  std::vector<std::size_t> changed_;  // meshes that were exchanged since the instances were placed last
  std::uint64_t exchanges_;
  std::uint64_t count_ = 0;                    // of triangles
  bool reshaped_ = false;                      // instances can be hit that could not, or the other way round
  mutable std::vector<Transform> transforms_;  // of an earlier time while they are to be read
  mutable std::function<void(std::span<Transform>)> read_transforms_;  // empty: they are here
  mutable std::atomic<bool> transforms_late_{false};
  mutable std::vector<Instance> instances_;  // these two of an earlier time while they are late
  mutable TopTree top_;
  mutable std::atomic<bool> late_{false};
  mutable std::mutex bringing_, bringing_transforms_;
};

/// Builds the top-level tree. Instances without a box (of empty meshes) are left out. `groups`: of each instance; none:
/// there are none. Else the instances of each have a tree, and a tree over the roots of these is the one over all.
TopTree build_top(std::span<const Instance> instances, std::span<const MeshTree> meshes,
                  std::span<const std::uint32_t> groups = {});

/// Moves the boxes of a top-level tree, whose shape stays, to instances of the same meshes.
void refit_top(TopTree& top, std::span<const Instance> instances);

/// The cost of a refitted top-level tree over that at its build from which on it is built anew.
inline constexpr double kMostTopDecay = 1.25;

}  // namespace ballot
