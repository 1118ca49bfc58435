#include "engine/oracle/nearest.h"

#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace ballot {

namespace {

using Exact = std::array<Dyadic, 3>;

Exact minus(const glm::vec3& a, const glm::vec3& b) {
  return {Dyadic(a.x) - Dyadic(b.x), Dyadic(a.y) - Dyadic(b.y), Dyadic(a.z) - Dyadic(b.z)};
}
Dyadic dot_of(const Exact& a, const Exact& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Exact cross_of(const Exact& a, const Exact& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// Returns the squared distance of the origin from the edge between p and q.
ExactDistance edge_distance(const Exact& p, const Exact& q, const Exact& edge) {
  const Dyadic at_p = Dyadic(0) - dot_of(p, edge), at_q = dot_of(q, edge), whole = dot_of(edge, edge);
  if (at_p.sign() <= 0) return {dot_of(p, p), Dyadic(1)};
  if (at_q.sign() <= 0) return {dot_of(q, q), Dyadic(1)};
  return {dot_of(p, p) * whole - at_p * at_p, whole};
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
  return dot_of(minus(point, t[0]), cross_of(minus(t[1], t[0]), minus(t[2], t[0]))).sign();
}

/// Returns the sign of n . (point - corner).
int side_of_corner(const glm::vec3& point, const glm::vec3& corner, const glm::vec3& n) {
  const glm::dvec3 d = double_difference(point, corner), normal(n);
  if (const auto sign = sure_sign(glm::dot(d, normal), glm::length(d) * glm::length(normal))) return *sign;
  return dot_of(minus(point, corner), minus(n, glm::vec3(0))).sign();
}

/// Returns the sign of n . (point - c), with c the nearest point of the line through a and b.
int side_of_edge(const glm::vec3& point, const glm::vec3& a, const glm::vec3& b, const glm::vec3& n) {
  const glm::dvec3 d = double_difference(point, a), e = double_difference(b, a), normal(n);
  const double about = glm::dot(normal, d) * glm::dot(e, e) - glm::dot(d, e) * glm::dot(normal, e);
  if (const auto sign = sure_sign(about, glm::length(normal) * glm::length(d) * glm::dot(e, e))) return *sign;
  const Exact out = minus(point, a), along = minus(b, a), up = minus(n, glm::vec3(0));
  return (dot_of(up, out) * dot_of(along, along) - dot_of(out, along) * dot_of(up, along)).sign();
}

/// The side of the projected edge from p to q for a point at the origin, and its sign with ties broken.
struct ExactSide {
  ExactSide(const Exact& p, const Exact& q) : value(q[1] * p[2] - q[2] * p[1]), sign(value.sign()) {
    if (sign == 0) sign = (q[2] - p[2]).sign();
    if (sign == 0) sign = (p[1] - q[1]).sign();
  }
  Dyadic value;
  int sign;
};

}  // namespace

double ExactDistance::distance() const { return std::sqrt(quotient(above, below)); }

ExactDistance exact_distance(const glm::vec3& point, const Triangle& t) {
  const Exact v[3] = {minus(t[0], point), minus(t[1], point), minus(t[2], point)};
  const Exact e[3] = {minus(t[1], t[0]), minus(t[2], t[1]), minus(t[0], t[2])};
  const Exact normal = cross_of(e[0], e[1]);
  const Dyadic area = dot_of(normal, normal);
  bool over = area.sign() > 0;
  for (std::size_t i = 0; i < 3 && over; ++i) over = dot_of(cross_of(normal, e[i]), v[i]).sign() <= 0;
  if (over) {
    const Dyadic depth = dot_of(normal, v[0]);
    return {depth * depth, area};
  }
  ExactDistance best = edge_distance(v[0], v[1], e[0]);
  for (std::size_t i = 1; i < 3; ++i) best = std::min(best, edge_distance(v[i], v[(i + 1) % 3], e[i]));
  return best;
}

std::uint32_t exact_part(const glm::vec3& point, const Triangle& t) {
  const Exact v[3] = {minus(t[0], point), minus(t[1], point), minus(t[2], point)};
  const Exact e[3] = {minus(t[1], t[0]), minus(t[2], t[1]), minus(t[0], t[2])};
  const Exact normal = cross_of(e[0], e[1]);
  bool over = true;
  for (std::size_t i = 0; i < 3 && over; ++i) over = dot_of(cross_of(normal, e[i]), v[i]).sign() < 0;
  if (over) return PART_INSIDE;
  ExactDistance best;
  std::uint32_t part = 0;
  for (std::uint32_t i = 0; i < 3; ++i) {
    const std::uint32_t j = (i + 1) % 3;
    ExactDistance d = edge_distance(v[i], v[j], e[i]);
    if (i > 0 && d >= best) continue;
    best = std::move(d);
    part = dot_of(v[i], e[i]).sign() >= 0 ? i : dot_of(v[j], e[i]).sign() <= 0 ? j : PART_EDGE + i;
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
  const Exact d{Dyadic(ray.dir.x), Dyadic(ray.dir.y), Dyadic(ray.dir.z)};
  int signs[3];
  for (int i = 0; i < 3; ++i) {
    int& sign = signs[i] = sight.side[i].sign();
    // A step s of the origin adds d . (s x (p - q)) to the side of the edge from p to q.
    const Exact back = minus(t[std::size_t(i + 1) % 3], t[std::size_t(i + 2) % 3]);
    for (int k = 1; k <= 2 && sign == 0; ++k) {
      Exact step;
      step[std::size_t(main_axis + k) % 3] = Dyadic(1);
      sign = dot_of(d, cross_of(step, back)).sign();
    }
  }
  return signs[0] != 0 && signs[0] == signs[1] && signs[1] == signs[2];
}

bool exact_crosses_ahead(const glm::vec3& point, const Triangle& t) {
  // Far from the ray in one of the other axes, or behind the point: not crossed, however ties are broken.
  const glm::vec3 lo = glm::min(t[0], glm::min(t[1], t[2])), hi = glm::max(t[0], glm::max(t[1], t[2]));
  if (lo.y > point.y || hi.y < point.y || lo.z > point.z || hi.z < point.z || hi.x < point.x) return false;
  const Exact v[3] = {minus(t[0], point), minus(t[1], point), minus(t[2], point)};
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
