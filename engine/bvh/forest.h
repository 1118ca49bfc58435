// The forest: the trees of meshes, and a top-level tree over instances of them. Uses no Vulkan.
#pragma once

#include <functional>
#include <glm/vec4.hpp>
#include <memory>
#include <vector>

#include "engine/bvh/instance.h"

namespace ballot {

/// A mesh in its own space, and its tree.
struct MeshTree {
  std::vector<Triangle> triangles;
  Bvh bvh;
  MeshExtents extents;
};

/// The top-level tree as the device reads it (shaders/shared/layout.h).
struct TopTree {
  std::vector<glm::uvec4> texels;    // inner nodes, then the records of the instances
  std::uint32_t records = 0;         // the texel at which the records begin
  std::uint32_t root = END_OF_TREE;  // child reference; END_OF_TREE: no instance can be hit
  std::uint32_t depth = 0;           // inner nodes on the longest path
  Bounds bounds;                     // of the boxes of all instances
  double cost = 0, built_cost = 0;   // by the SAH, in nodes: now, and when it was built
  double build_s = 0;                // wall time in seconds of the last build or refit
};

/// Meshes with their trees, and their instances below a top-level tree. Hits number the triangles of the first instance
/// first, then those of the second, and so on, as if the scene had been made of moved copies.
class Forest {
 public:
  using BuildMesh = std::function<Bvh(std::span<const Triangle>)>;

  /// Builds the trees of the meshes by `build`, and the top-level tree. Throws Error(Arguments) if a placement names no
  /// mesh, as place_instance() does, or if there are too many triangles; and what `build` throws.
  Forest(std::vector<std::vector<Triangle>> meshes, std::span<const Placement> placements, const BuildMesh& build);

  /// Moves the instances: one transform for each. The top-level tree is refitted, and built anew once that has raised
  /// its cost by a quarter; the trees of the meshes stay. Hits do not depend on it. If it throws, as the constructor
  /// does, nothing has changed.
  void move(std::span<const Transform> transforms);

  const std::vector<MeshTree>& meshes() const { return meshes_; }
  const std::vector<Instance>& instances() const { return instances_; }
  const std::vector<Transform>& transforms() const { return transforms_; }
  const TopTree& top() const { return top_; }
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
  /// Returns a triangle in the world, moved in double precision and rounded.
  Triangle triangle(const Place& place) const;

 private:
  std::vector<Instance> placed(std::span<const Transform> transforms) const;
  void set(std::vector<Instance> instances, TopTree top);

  std::vector<MeshTree> meshes_;
  std::vector<std::uint32_t> mesh_of_;  // of each instance
  std::vector<Instance> instances_;
  std::vector<Transform> transforms_;
  TopTree top_;
  Bvh summary_;
};

/// Builds the top-level tree. Instances without a box (of empty meshes) are left out.
TopTree build_top(std::span<const Instance> instances, std::span<const MeshTree> meshes);

/// Moves the boxes of a top-level tree, whose shape stays, to instances of the same meshes.
void refit_top(TopTree& top, std::span<const Instance> instances);

/// The cost of a refitted top-level tree over that at its build from which on it is built anew.
inline constexpr double kMostTopDecay = 1.25;

}  // namespace ballot
