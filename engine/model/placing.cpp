#include "engine/model/placing.h"

#include <cmath>
#include <glm/geometric.hpp>

namespace ballot {
namespace {

/// Returns the column scaled to length 1; `otherwise` if its length is zero or not finite.
glm::dvec3 unit(const glm::dvec4& column, const glm::dvec3& otherwise) {
  const double length = glm::length(glm::dvec3{column});
  return length > 0 && std::isfinite(length) ? glm::dvec3{column} / length : otherwise;
}

double determinant(const glm::dmat4& m) {
  return glm::dot(glm::cross(glm::dvec3{m[0]}, glm::dvec3{m[1]}), glm::dvec3{m[2]});
}

}  // namespace

glm::vec3 transform_point(const glm::dmat4& m, const glm::dvec3& p) {
  return glm::vec3{m[0][0] * p.x + m[1][0] * p.y + m[2][0] * p.z + m[3][0],
                   m[0][1] * p.x + m[1][1] * p.y + m[2][1] * p.z + m[3][1],
                   m[0][2] * p.x + m[1][2] * p.y + m[2][2] * p.z + m[3][2]};
}

Transform transform_of(const glm::dmat4& m) {
  Transform t;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 4; ++column) t.m[row][column] = static_cast<float>(m[column][row]);
  return t;
}

glm::dmat3 normal_matrix(const glm::dmat4& m) {
  const glm::dvec3 a{m[0]}, b{m[1]}, c{m[2]};
  const double sign = mirrors(m) ? -1 : 1;
  return {sign * glm::cross(b, c), sign * glm::cross(c, a), sign * glm::cross(a, b)};
}

bool mirrors(const glm::dmat4& m) { return determinant(m) < 0; }

glm::vec3 unit_or_zero(const glm::dvec3& n) {
  const double length = glm::length(n);
  return length > 1e-30 && std::isfinite(length) ? glm::vec3{n / length} : glm::vec3{0};
}

glm::dmat4 without_scale(const glm::dmat4& m) {
  const glm::dvec3 back = unit(m[2], {0, 0, 1});
  glm::dvec3 up = unit(m[1], {0, 1, 0});
  if (glm::length(glm::cross(up, back)) < 1e-9) up = std::abs(back.y) < 0.9 ? glm::dvec3{0, 1, 0} : glm::dvec3{0, 0, 1};
  const glm::dvec3 right = glm::normalize(glm::cross(up, back));
  return {glm::dvec4{right, 0}, glm::dvec4{glm::cross(back, right), 0}, glm::dvec4{back, 0}, m[3]};
}

void place_light(Light& light, const glm::dmat4& world_from_node) {
  light.position = glm::vec3(world_from_node[3]);
  light.direction = -glm::vec3(unit(world_from_node[2], {0, 0, 1}));
}

}  // namespace ballot
