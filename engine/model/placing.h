// Places what nodes carry: points, normals, cameras and lights.
#pragma once

#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

#include "engine/model/light.h"
#include "engine/model/placement.h"

namespace ballot {

/// Transforms a point in double and rounds it once. The sum runs from left to right, so any repetition in double gives
/// the same bits.
glm::vec3 transform_point(const glm::dmat4& m, const glm::dvec3& p);

/// Returns the matrix of an instance, rounded to float32.
Transform transform_of(const glm::dmat4& m);

/// Returns the inverse transpose up to a positive factor: the cofactors, with the sign of the determinant.
glm::dmat3 normal_matrix(const glm::dmat4& m);

/// Returns true if the matrix mirrors: its determinant is negative. Mirroring reverses the winding of triangles.
bool mirrors(const glm::dmat4& m);

/// Returns the unit vector, or zero if the normal is too short or not finite.
glm::vec3 unit_or_zero(const glm::dvec3& n);

/// Returns the transform with a pure rotation. It keeps the direction of -z, and that of +y as far as possible.
glm::dmat4 without_scale(const glm::dmat4& m);

/// Moves a light to the place and direction that a node gives it.
void place_light(Light& light, const glm::dmat4& world_from_node);

}  // namespace ballot
