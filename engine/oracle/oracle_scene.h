// What oracles look at: the trees of meshes, and the instances that place them. A single tree is one mesh, placed as it
// is.
#pragma once

#include <glm/vector_relational.hpp>
#include <memory>
#include <span>
#include <vector>

#include "engine/bvh/moved_corners.h"
#include "engine/formats/pair.h"

namespace ballot {

/// A mesh as a ray meets it, by the definition of object-space rays (engine/bvh/instance.h).
struct PlacedMesh {
  const PairTree& tree;
  std::span<const Triangle> triangles;  // of the mesh, or none
  Ray ray;                              // in the mesh's space
  double scale = 1;                     // of t, from this ray's to the given ray's
  std::uint32_t first = 0;              // number in the scene of the mesh's first triangle
  bool mirrors = false;                 // the instance turns the fronts of triangles
};

/// Meshes and instances. Thread-safe.
class OracleScene {
 public:
  /// One tree, and the scene's triangles by their prims, or none. Keeps references.
  OracleScene(const PairTree& tree, std::span<const Triangle> triangles = {})
      : trees_(&tree, 1), triangles_(triangles) {}
  /// A forest, and the pair trees of its meshes. Keeps references.
  OracleScene(const Forest& forest, std::span<const PairTree> trees) : forest_(&forest), trees_(trees) {}
  /// The same; makes the pair trees. The forest may move its instances.
  explicit OracleScene(const Forest& forest);

  /// Returns the forest, or null if this is a single tree.
  const Forest* forest() const { return forest_; }
  /// Return the trees of all meshes, and the triangles of one; none if a single tree was given without.
  std::span<const PairTree> trees() const { return trees_; }
  std::span<const Triangle> triangles(std::size_t mesh) const {
    return forest_ ? std::span<const Triangle>(forest_->meshes()[mesh].triangles) : triangles_;
  }
  /// Returns the bounds of what can be hit.
  const Bounds& bounds() const { return forest_ ? forest_->top_facts().bounds : trees_[0].bounds; }

  /// Calls visit(PlacedMesh) for every instance that a ray may meet, in their order. The ray must not be dead.
  template <class Visit>
  void for_each(const Ray& ray, const Visit& visit) const {
    if (!forest_) {
      visit(PlacedMesh{trees_[0], triangles_, ray});
      return;
    }
    for (const Instance& i : forest_->instances())
      if (!surely_misses(i, ray)) visit(placed(i, ray));
  }

  /// Calls visit(number of the mesh, point in its space) for every instance whose inside may hold a point, by the
  /// definition of shaders/lib/query/inside_instances.glsl; of a single tree with the point as it is.
  template <class Visit>
  void for_each_around(const glm::vec3& point, const Visit& visit) const {
    if (!forest_) {
      visit(std::size_t{0}, point);
      return;
    }
    for (const Instance& i : forest_->instances()) {
      const glm::vec3 at = object_ray({point, 0, {1, 0, 0}, 1}, i.map).origin;
      const Bounds& b = forest_->meshes()[i.mesh].bvh.bounds;
      if (glm::all(glm::greaterThanEqual(at, b.lo)) && glm::all(glm::lessThanEqual(at, b.hi)))
        visit(std::size_t{i.mesh}, at);
    }
  }

  /// Returns a triangle of the scene in the world, as closest points have it (engine/bvh/moved_corners.h).
  Triangle world_triangle(std::uint32_t prim) const {
    return forest_ ? moved_triangle(*forest_, prim) : triangles_[prim];
  }

  /// Returns the mesh that holds a triangle of the scene, as a ray meets it. The ray must not be dead.
  PlacedMesh mesh_of(const Ray& ray, std::uint32_t prim) const;

 private:
  /// Returns true if the ray misses the instance's box, widened 16 times as far as the proof of that box asks, and by a
  /// 1000th of its size: the oracles shall find the errors of that proof, should there be some.
  bool surely_misses(const Instance& instance, const Ray& ray) const;
  PlacedMesh placed(const Instance& instance, const Ray& ray) const;

  const Forest* forest_ = nullptr;
  std::shared_ptr<const std::vector<PairTree>> made_;
  std::span<const PairTree> trees_;
  std::span<const Triangle> triangles_;  // of a single tree
};

}  // namespace ballot
