#include "engine/oracle/nearest.h"

#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace ballot {

namespace {

/// Returns the squared distance of the origin from the edge between p and q.
ExactDistance edge_distance(const DyadicVec& p, const DyadicVec& q, const DyadicVec& edge) {
  const Dyadic at_p = Dyadic(0) - dot(p, edge), at_q = dot(q, edge), whole = dot(edge, edge);
  if (at_p.sign() <= 0) return {dot(p, p), Dyadic(1)};
  if (at_q.sign() <= 0) return {dot(q, q), Dyadic(1)};
  return {dot(p, p) * whole - at_p * at_p, whole};
}

/// Returns the sign of a sum of products in double precision if it is larger than its error: `size` times 2^-40.
std::optional<int> sure_sign(double value, double size) {
  // Below 1e-280 the bound of the error itself may be lost.
  if (!(std::abs(value) > 0x1p-40 * size) || std::abs(value) < 1e-280) return std::nullopt;
  return value > 0 ? 1 : -1;
}

glm::dvec3 double_difference(const glm::vec3& a, const glm::vec3& b) { return glm::dvec3(a) - glm::dvec3(b); }

/// Returns the sign of normal . (point - t[0]).
int side_of_plane(const glm::vec3& point, const Triangle& t) {
  const glm::dvec3 d = double_difference(point, t[0]), a = double_difference(t[1], t[0]),
                   b = double_difference(t[2], t[0]);
  const double size = glm::length(d) * glm::length(a) * glm::length(b);
  if (const auto sign = sure_sign(glm::dot(d, glm::cross(a, b)), size)) return *sign;
  return dot(difference(point, t[0]), cross(difference(t[1], t[0]), difference(t[2], t[0]))).sign();
}

/// Returns the sign of n . (point - corner).
int side_of_corner(const glm::vec3& point, const glm::vec3& corner, const glm::vec3& n) {
  const glm::dvec3 d = double_difference(point, corner), normal(n);
  if (const auto sign = sure_sign(glm::dot(d, normal), glm::length(d) * glm::length(normal))) return *sign;
  return dot(difference(point, corner), difference(n, glm::vec3(0))).sign();
}

/// Returns the sign of n . (point - c), with c the nearest point of the line through a and b.
int side_of_edge(const glm::vec3& point, const glm::vec3& a, const glm::vec3& b, const glm::vec3& n) {
  const glm::dvec3 d = double_difference(point, a), e = double_difference(b, a), normal(n);
  const double about = glm::dot(normal, d) * glm::dot(e, e) - glm::dot(d, e) * glm::dot(normal, e);
  if (const auto sign = sure_sign(about, glm::length(normal) * glm::length(d) * glm::dot(e, e))) return *sign;
  const DyadicVec out = difference(point, a), along = difference(b, a), up = difference(n, glm::vec3(0));
  return (dot(up, out) * dot(along, along) - dot(out, along) * dot(up, along)).sign();
}

/// The side of the projected edge from p to q for a point at the origin, and its sign with ties broken.
struct ExactSide {
  ExactSide(const DyadicVec& p, const DyadicVec& q) : value(q[1] * p[2] - q[2] * p[1]), sign(value.sign()) {
    if (sign == 0) sign = (q[2] - p[2]).sign();
    if (sign == 0) sign = (p[1] - q[1]).sign();
  }
  Dyadic value;
  int sign;
};

}  // namespace

double ExactDistance::distance() const { return std::sqrt(quotient(above, below)); }

ExactDistance exact_distance(const glm::vec3& point, const Triangle& t) {
  const DyadicVec v[3] = {difference(t[0], point), difference(t[1], point), difference(t[2], point)};
  const DyadicVec e[3] = {difference(t[1], t[0]), difference(t[2], t[1]), difference(t[0], t[2])};
  const DyadicVec normal = cross(e[0], e[1]);
  const Dyadic area = dot(normal, normal);
  bool over = area.sign() > 0;
  for (std::size_t i = 0; i < 3 && over; ++i) over = dot(cross(normal, e[i]), v[i]).sign() <= 0;
  if (over) {
    const Dyadic depth = dot(normal, v[0]);
    return {depth * depth, area};
  }
  ExactDistance best = edge_distance(v[0], v[1], e[0]);
  for (std::size_t i = 1; i < 3; ++i) best = std::min(best, edge_distance(v[i], v[(i + 1) % 3], e[i]));
  return best;
}

std::uint32_t exact_part(const glm::vec3& point, const Triangle& t) {
  const DyadicVec v[3] = {difference(t[0], point), difference(t[1], point), difference(t[2], point)};
  const DyadicVec e[3] = {difference(t[1], t[0]), difference(t[2], t[1]), difference(t[0], t[2])};
  const DyadicVec normal = cross(e[0], e[1]);
  bool over = true;
  for (std::size_t i = 0; i < 3 && over; ++i) over = dot(cross(normal, e[i]), v[i]).sign() < 0;
  if (over) return PART_INSIDE;
  ExactDistance best;
  std::uint32_t part = 0;
  for (std::uint32_t i = 0; i < 3; ++i) {
    const std::uint32_t j = (i + 1) % 3;
    ExactDistance d = edge_distance(v[i], v[j], e[i]);
    if (i > 0 && d >= best) continue;
    best = std::move(d);
    part = dot(v[i], e[i]).sign() >= 0 ? i : dot(v[j], e[i]).sign() <= 0 ? j : PART_EDGE + i;
  }
  return part;
}

bool exact_behind(const glm::vec3& point, const Triangle& t, std::uint32_t part,
                  std::span<const glm::vec3, PSEUDONORMALS> pseudonormals) {
  if (part == PART_INSIDE) return side_of_plane(point, t) < 0;
  const glm::vec3& n = pseudonormals[part];
  if (part < PART_EDGE) return side_of_corner(point, t[part], n) < 0;
  const std::size_t i = part - PART_EDGE;
  return side_of_edge(point, t[i], t[(i + 1) % 3], n) < 0;
}

bool exact_crosses(const Ray& ray, const Triangle& t, const ExactSight& sight) {
  const glm::vec3 size = glm::abs(ray.dir);
  const int main_axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const DyadicVec d{Dyadic(ray.dir.x), Dyadic(ray.dir.y), Dyadic(ray.dir.z)};
  int signs[3];
  for (int i = 0; i < 3; ++i) {
    int& sign = signs[i] = sight.side[i].sign();
    // A step s of the origin adds d . (s x (p - q)) to the side of the edge from p to q.
    const DyadicVec back = difference(t[std::size_t(i + 1) % 3], t[std::size_t(i + 2) % 3]);
    for (int k = 1; k <= 2 && sign == 0; ++k) {
      DyadicVec step;
      step[std::size_t(main_axis + k) % 3] = Dyadic(1);
      sign = dot(d, cross(step, back)).sign();
    }
  }
  return signs[0] != 0 && signs[0] == signs[1] && signs[1] == signs[2];
}

bool exact_crosses_ahead(const glm::vec3& point, const Triangle& t) {
  // Far from the ray in one of the other axes, or behind the point: not crossed, however ties are broken.
  const glm::vec3 lo = glm::min(t[0], glm::min(t[1], t[2])), hi = glm::max(t[0], glm::max(t[1], t[2]));
  if (lo.y > point.y || hi.y < point.y || lo.z > point.z || hi.z < point.z || hi.x < point.x) return false;
  const DyadicVec v[3] = {difference(t[0], point), difference(t[1], point), difference(t[2], point)};
  const ExactSide sides[3] = {{v[1], v[2]}, {v[2], v[0]}, {v[0], v[1]}};
  if (sides[0].sign == 0 || sides[0].sign != sides[1].sign || sides[1].sign != sides[2].sign) return false;
  const Dyadic x = sides[0].value * v[0][0] + sides[1].value * v[1][0] + sides[2].value * v[2][0];
  return x.sign() == sides[0].sign;
}

bool exact_inside(const glm::vec3& point, std::span<const Triangle> triangles) {
  bool inside = false;
  for (const Triangle& t : triangles) inside = inside != exact_crosses_ahead(point, t);
  return inside;
}

}  // namespace ballot
