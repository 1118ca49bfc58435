// What oracles look at: the trees of meshes, and the instances that place them. A single tree is one mesh, placed as it
// is. Every oracle answers about a scene, by what it finds in the meshes that a ray meets, or near a point.
#pragma once

#include <functional>
#include <glm/vector_relational.hpp>
#include <memory>
#include <span>
#include <vector>

#include "engine/tree/formats/pair.h"
#include "engine/tree/host/moved_corners.h"

namespace ballot {

/// A hit in double precision, or a miss (prim is NO_HIT and the others are zero). t counts multiples of the direction;
/// u and v are the barycentric coordinates of vertices 1 and 2.
struct OracleHit {
  double t = 0;
  std::uint32_t prim = NO_HIT;
  double u = 0, v = 0;
};

/// A mesh as a ray meets it, by the definition of object-space rays (engine/tree/host/instance.h).
struct PlacedMesh {
  const PairTree& tree;
  std::span<const Triangle> triangles;  // of the mesh, or none
  RayInDouble ray;                      // in the mesh's space: of float32, unless OracleScene::in_double()
  double scale = 1;                     // of t, from this ray's to the given ray's
  std::uint32_t mesh = 0;               // its number
  std::uint32_t first = 0;              // number in the scene of the mesh's first triangle
  bool mirrors = false;                 // the instance turns the fronts of triangles
  ShapeKind kind = ShapeKind::Triangles;
  std::span<const Shape> shapes = {};  // that the triangles stand in for; none of kind Triangles
};

/// Meshes and instances. Thread-safe.
class OracleScene {
 public:
  /// One tree, and the scene's triangles by their prims, or none. Keeps references.
  OracleScene(const PairTree& tree, std::span<const Triangle> triangles = {});
  /// A forest, which must keep its transforms, and the pair trees of its meshes. Keeps references.
  OracleScene(const Forest& forest, std::vector<const PairTree*> trees);
  /// The same; makes the pair trees of trees that all have their nodes.
  OracleScene(const Forest& forest);

  /// Returns the same scene for rays of mode double, which instances move in double. Keeps the same references.
  OracleScene in_double() const;

  /// Returns the forest, or null if this is a single tree.
  const Forest* forest() const { return forest_; }
  /// Return the trees of all meshes, and the triangles of one; none if a single tree was given without.
  std::span<const PairTree* const> trees() const { return trees_; }
  std::span<const Triangle> triangles(std::size_t mesh) const {
    return forest_ ? std::span<const Triangle>(forest_->meshes()[mesh].triangles) : triangles_;
  }
  /// Returns the bounds of what can be hit.
  const Bounds& bounds() const { return forest_ ? forest_->top_facts().bounds : trees_[0]->bounds; }

  /// Calls visit(PlacedMesh) for every instance that a ray may meet, in their order. The ray must not be dead.
  template <class Visit>
  void for_each(const Ray& ray, const Visit& visit) const {
    if (!forest_) {
      visit(PlacedMesh{*trees_[0], triangles_, ballot::in_double(ray)});
      return;
    }
    for (const std::uint32_t i : met(ray)) visit(placed(forest_->instances()[i], ray));
  }

  /// Calls visit(number of the mesh, point in its space) for every instance whose inside may hold a point, by the
  /// definition of shaders/lib/query/inside_instances.glsl; of a single tree with the point as it is.
  template <class Visit>
  void for_each_around(const glm::vec3& point, const Visit& visit) const {
    if (!forest_) {
      visit(std::size_t{0}, point);
      return;
    }
    for (const std::uint32_t number : met({point, 0, {1, 0, 0}, 0})) {
      const Instance& i = forest_->instances()[number];
      const glm::vec3 at = object_ray({point, 0, {1, 0, 0}, 1}, i.map).origin;
      const Bounds& b = forest_->meshes()[i.mesh].bvh->bounds;
      if (glm::all(glm::greaterThanEqual(at, b.lo)) && glm::all(glm::lessThanEqual(at, b.hi)))
        visit(std::size_t{i.mesh}, at);
    }
  }

  /// Is given a triangle of the scene, with its corners in the world (engine/tree/host/moved_corners.h).
  using VisitTriangle = std::function<void(std::uint32_t prim, const Triangle& triangle)>;
  /// Calls visit for every triangle of a leaf that may be within a distance of a point, near leaves first. `far` is the
  /// square of the distance; visit may lower it.
  void for_each_near(const glm::dvec3& point, const double& far, const VisitTriangle& visit) const;

  /// Returns a triangle of the scene in the world, as closest points have it (engine/tree/host/moved_corners.h).
  Triangle world_triangle(std::uint32_t prim) const {
    return forest_ ? moved_triangle(*forest_, prim) : triangles_[prim];
  }

  /// Returns the nearest hit of a ray that is not dead: of the hits of instances, each by nearest(PlacedMesh), that of
  /// the smallest t, at equal t of the first instance.
  template <class Nearest>
  OracleHit nearest(const Ray& ray, const Nearest& nearest_in) const {
    OracleHit best;
    for_each(ray, [&](const PlacedMesh& mesh) {
      OracleHit hit = nearest_in(mesh);
      if (hit.prim == NO_HIT) return;
      hit.t *= mesh.scale;
      hit.prim += mesh.first;
      if (best.prim == NO_HIT || hit.t < best.t) best = hit;
    });
    return best;
  }

  /// Returns true unless the scene has fewer triangles than `prim`. The leaves of a single tree tell what it has.
  bool may_have(std::uint32_t prim) const { return !forest_ || prim < forest_->triangle_count(); }
  /// The mesh that holds a triangle of the scene, and the number in the scene of the mesh's first triangle there.
  struct Place {
    std::uint32_t mesh = 0, first = 0;
  };
  Place place_of(std::uint32_t prim) const;
  /// Returns that mesh as a ray meets it. The ray must not be dead.
  PlacedMesh mesh_of(const Ray& ray, std::uint32_t prim) const;

  /// Returns where a leaf of a mesh's tree holds a triangle: a texel, or NO_HIT if none does.
  std::uint32_t leaf_texel_of(std::size_t mesh, std::uint32_t prim) const;

 private:
  struct Boxes;
  struct Leaves;
  /// Returns the instances that a ray may meet, in order.
  std::vector<std::uint32_t> met(const Ray& ray) const;
  PlacedMesh placed(const Instance& instance, const Ray& ray) const;

  const Forest* forest_ = nullptr;
  bool moves_in_double_ = false;  // instances do
  std::shared_ptr<const std::vector<PairTree>> made_;
  std::vector<const PairTree*> trees_;
  std::span<const Triangle> triangles_;  // of a single tree
  std::shared_ptr<const Boxes> boxes_;   // of the instances
  std::shared_ptr<Leaves> leaves_;       // found on first use
};

}  // namespace ballot
