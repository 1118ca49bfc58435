// Meshes and instances in double: the origins that their float32 numbers are counted from.
#pragma once

#include <array>

#include "engine/api/meshes.h"

namespace ballot::api {

/// A 3 x 4 matrix of an instance as its caller gave it, row by row.
using MatrixInDouble = std::array<double, 12>;

/// Instances as they were given. Their transforms are those about the origins once place_about() has set them.
struct GivenInstances {
  std::vector<Placement> placements;
  std::vector<MatrixInDouble> matrices;
  bool in_double = false;
};
/// Checks instances and reads them. Throws Refused.
GivenInstances read_instances(const BallotInstances& given);

/// Reads the matrix of an instance.
template <class Number>
MatrixInDouble matrix_at(const Number* matrices, std::size_t stride, std::size_t i) {
  std::array<Number, 12> read;
  std::memcpy(read.data(), reinterpret_cast<const char*>(matrices) + i * stride, sizeof read);
  MatrixInDouble matrix;
  std::ranges::copy(read, matrix.begin());
  return matrix;
}

/// Returns a matrix from numbers about a mesh's origin to those about the scene's, computed in double and rounded.
Transform about(const MatrixInDouble& matrix, const glm::dvec3& mesh, const glm::dvec3& scene);

/// The origins that a scene's meshes are read about.
struct Origins {
  glm::dvec3 scene{0};
  std::vector<glm::dvec3> meshes;
};
/// Finds those that the caller has not named. `instances` null: each mesh lies in the world. Throws Refused if one
/// that was found is not that of an array on the device.
Origins find_origins(const BallotMesh* meshes, std::size_t count, const GivenInstances* instances,
                     const double (&scene)[3]);
/// Returns the origin of a mesh by itself.
glm::dvec3 own_origin(const BallotMesh& m, const std::string& where);

/// Vertices of a mesh, counted from an origin and rounded.
struct RoundedVertices {
  DenseVertices vertices;
  double moved;                     // how far rounding has moved one at most
  VerticesInDouble in_double = {};  // null if it has moved none
};
/// `in_double` or `positions` has them, the other is null. `stride` in bytes; 0: side by side. `where` begins errors.
RoundedVertices round_vertices(const float* positions, const double* in_double, std::size_t count, std::size_t stride,
                               const glm::dvec3& origin, const std::string& where);

}  // namespace ballot::api
