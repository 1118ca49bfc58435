// Refits of trees on the host: a tree keeps its shape while its triangles move.
#pragma once

#include <span>

#include "engine/tree/host/bvh.h"

namespace ballot {

/// What is known of triangles that are to take the place of others.
struct MovedTriangles {
  Bounds bounds;          // of all vertices; zero if there are none
  bool same_area = true;  // exactly those triangles have no area that had none before
};

/// Looks at triangles on all cores. `before` are the triangles whose place they take, of which `degenerate` have no
/// area. Throws Error(Arguments) if the numbers differ, and as bounds_of_vertices() and build_bvh() do if a coordinate
/// is not finite or beyond +-1e12; the first such triangle is named, and `scene` in the text.
MovedTriangles check_moved(std::span<const Triangle> before, std::size_t degenerate, std::span<const Triangle> now,
                           std::string_view scene);

/// Gives the boxes of a tree to triangles that have moved, on all cores, and sets its bounds and BvhStats::sah. The
/// shape of the tree stays. Where spatial splits have put parts of a triangle into several leaves, each of these takes
/// the box of the whole triangle. The triangles are as many as the tree was built of, valid for build_bvh(), and
/// exactly those without area then have none now (check_moved). The result does not depend on the number of cores.
void refit_bvh(Bvh& bvh, std::span<const Triangle> triangles, const BuildSettings& settings);

}  // namespace ballot
