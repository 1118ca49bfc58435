#include "engine/tree/host/moved_corners.h"

#include "engine/core/error.h"
#include "engine/core/memory.h"
#include "engine/core/parallel.h"
#include "engine/tree/host/build.h"

namespace ballot {

namespace {

constexpr std::size_t kMovedAtOnce = 1 << 12;

}  // namespace

Triangle moved_triangle(const Forest& forest, std::uint32_t prim) {
  const Forest::Place at = forest.place_of(prim);
  return moved_corners(forest.transforms()[at.instance],
                       forest.meshes()[forest.mesh_of(at.instance)].triangles[at.triangle]);
}

UnsetVector<Triangle> moved_triangles(const Forest& forest) {
  const std::uint64_t count = forest.triangle_count();
  need_memory(count * sizeof(Triangle), fmt::format("a list of the {} triangles of all instances", count));
  UnsetVector<Triangle> all(count);
  for (std::size_t i = 0; i < forest.size(); ++i) {
    const std::span<const Triangle> mesh = forest.meshes()[forest.mesh_of(i)].triangles;
    const Transform& transform = forest.transforms()[i];
    const std::size_t first = forest.first_of(i);
    for_chunks(mesh.size(), kMovedAtOnce, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) {
        Triangle& to = all[first + k];
        to = moved_corners(transform, mesh[k]);
        if (is_degenerate(mesh[k])) to[1] = to[2] = to[0];
      }
    });
  }
  return all;
}

}  // namespace ballot
