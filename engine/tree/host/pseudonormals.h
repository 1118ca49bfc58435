// Angle-weighted pseudonormals: the side of a surface on which a point lies, at its corners and edges too.
//
// Source: J. Andreas Baerentzen, Henrik Aanaes. Signed Distance Computation Using the Angle Weighted Pseudonormal. IEEE
// Transactions on Visualization and Computer Graphics 11(3), 2005. For a closed, manifold, consistently wound mesh
// without self-intersections they prove: a point P with the nearest point C lies inside if, and only if, the scalar
// product of P - C and the pseudonormal of the corner, edge or face that holds C is negative.
#pragma once

#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "engine/core/geometry.h"
#include "shaders/shared/query.h"

namespace ballot {

/// Returns PSEUDONORMALS vectors of each triangle: of its corners 0, 1, 2, then of its edges 0 1, 1 2, 2 0. Corners and
/// edges of triangles are the same if their coordinates are equal; 0 and -0 are. An edge has the sum of the unit
/// normals of its triangles, a corner the sum of the unit normals times the angles there. Sums are made in double
/// precision and rounded once; they are not of unit length. Triangles without area add nothing and have zeros. Uses all
/// cores. Thread-safe.
std::vector<glm::vec3> pseudonormals_of(std::span<const Triangle> triangles);

}  // namespace ballot
