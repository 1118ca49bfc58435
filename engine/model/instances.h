// Scenes of instances: their checks, their bounds and their triangles in the world. No Vulkan.
#pragma once

#include "engine/model/scene.h"

namespace ballot {

/// Returns how far the rounding errors of an instance may grow: the largest sum of a row of |M| times that of |A|,
/// where M is the matrix and A its inverse, of magnitudes. 1 for scales by one number, at most 3 for rotations;
/// infinite for singular matrices.
double spread_of(const Transform& transform);

/// The largest spread of an instance in a scene. Where secondary rays start is proved up to it
/// (shaders/lib/origin/proof.glsl).
inline constexpr double kMostSpread = 4096;

/// Returns true if a scene may hold an instance with this transform: its entries are finite, its spread is at most
/// kMostSpread, and its columns have a length that place_instance() (engine/tree/host/instance.h) takes.
bool is_placeable(const Transform& transform);

/// Returns the matrix of an instance that its node may hide by a scale of 0, which has no inverse. Where all columns
/// are shorter than those that is_placeable() takes, they are made a little longer, without a mirror: the instance is a
/// point all the same, as float32 tells no size below it. Other matrices stay as they are.
glm::dmat4 not_quite_hidden(glm::dmat4 matrix);

bool is_identity(const Transform& transform);

/// Returns a triangle where the transform puts it, moved in double precision and rounded.
Triangle moved(const Triangle& triangle, const Transform& transform);

/// Returns the bounds of a box's moved corners, which hold those of whatever the box holds.
Bounds moved(const Bounds& box, const Transform& transform);

/// Returns the number of triangles, counted through the instances: hits have a smaller prim.
std::uint64_t triangle_count(const Scene& scene);

/// Calls visit(placement, triangle, prim) for each triangle in the order of their prims, but for those that no query
/// meets (Placement::mask). `triangle` is a number in the arrays of the scene. A flat scene has the placement 0.
template <class Visit>
void for_each_triangle(const Scene& scene, const Visit& visit) {
  if (!scene.instanced()) {
    for (std::size_t i = 0; i < scene.triangles.size(); ++i) visit(std::size_t{0}, i, static_cast<std::uint32_t>(i));
    return;
  }
  std::uint32_t prim = 0;
  for (std::size_t p = 0; p < scene.instances.placements.size(); ++p) {
    const auto& [mesh, transform, mask, group] = scene.instances.placements[p];
    if (mask == 0) prim += static_cast<std::uint32_t>(scene.instances.triangles_of(mesh));
    for (std::size_t i = scene.instances.first[mesh]; mask && i < scene.instances.first[mesh + 1]; ++i)
      visit(p, i, prim++);
  }
}

/// Returns all triangles in the world, by their prims; those that no query meets are points at zero. Throws Error(Work)
/// if there is no memory for them.
UnsetVector<Triangle> world_triangles(const Scene& scene);

/// Returns the bounds of a mesh in its own space; zero if it has no triangle.
Bounds bounds_of_mesh(const Scene& scene, std::size_t mesh);

/// Returns the bounds of all moved vertices.
Bounds bounds_of_instances(const Scene& scene);

/// The meshes and placements of a scene as its trees have them. Meshes that lie in the world and follow one another are
/// one mesh here, so that one tree holds them: in a flat scene, all.
struct TreeLayout {
  std::vector<std::size_t> first;      // as SceneInstances::first
  std::vector<Placement> placements;   // those that a query can meet
  std::vector<std::uint32_t> prims;    // of each, the number of its first triangle, and behind these their end
  std::vector<std::uint32_t> from;     // of each, the first of the scene's placements that it stands for
  std::vector<std::uint32_t> tree_of;  // of each mesh of the scene, its mesh here
  std::vector<ShapeKind> kinds;        // of each mesh here

  /// Returns true if a mesh of the scene lies in one tree with others.
  bool shares(std::size_t mesh) const {
    return (mesh > 0 && tree_of[mesh - 1] == tree_of[mesh]) ||
           (mesh + 1 < tree_of.size() && tree_of[mesh + 1] == tree_of[mesh]);
  }
};
TreeLayout tree_layout(const Scene& scene);

/// Throws Error(Arguments) unless each mesh is a range of the scene's triangles, each placement names a mesh, and the
/// triangles can be numbered.
void check_instances(const Scene& scene);

/// Throws Error(Arguments) unless each placement is_placeable(), as rays that start on surfaces need it.
void check_spreads(const Scene& scene);

/// Fills what a scene lacks of its meshes and placements. Without meshes it gets one, which holds all triangles;
/// without placements its meshes lie in the world, unless they are `placed`. Labels that are missing get numbers, and
/// without names the meshes get the scene's name, or "mesh N".
/// Throws Error(Arguments) as check_instances() does, and unless there is a label for each mesh and placement with a
/// name that exists, and a mesh that lies in the world is placed once, in order, with the identity.
void complete_instances(Scene& scene);

}  // namespace ballot
