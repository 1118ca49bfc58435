#include "engine/model/shapes.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

#include "engine/core/error.h"
#include "engine/core/exact_area.h"
#include "engine/core/parallel.h"
#include "engine/core/unit_normal.h"

namespace ballot {
namespace {

float down(double x) { return std::nextafter(float(x), -std::numeric_limits<float>::infinity()); }
float up(double x) { return std::nextafter(float(x), std::numeric_limits<float>::infinity()); }

Bounds around(const glm::vec4& sphere, const glm::dvec3& reach) {
  Bounds b;
  for (int k = 0; k < 3; ++k) b.lo[k] = down(double(sphere[k]) - reach[k]), b.hi[k] = up(double(sphere[k]) + reach[k]);
  return b;
}

void check_radii(std::span<const float> radii, const std::string& where) {
  for (std::size_t i = 0; i < radii.size(); ++i)
    if (!(radii[i] >= 0 && radii[i] <= 1e12f))
      fail(Failure::Arguments, "{}: the radius of vertex {} is {}; expected 0 to 1e12", where, i, radii[i]);
}

glm::vec3 unit(const glm::vec3& n, std::size_t i, const std::string& where) {
  const double length = glm::length(glm::dvec3(n));
  if (!(length > 0 && std::isfinite(length)))
    fail(Failure::Arguments, "{}: the normal of vertex {} is ({}, {}, {}); expected a finite vector that is not zero",
         where, i, n.x, n.y, n.z);
  return glm::vec3(glm::dvec3(n) / length);
}

Triangle corners_for(const Bounds& box) {
  const glm::vec3 size = box.hi - box.lo;
  const int k = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  glm::vec3 third = box.lo;
  third[k] = box.hi[k];
  return {box.lo, box.hi, third};
}

}  // namespace

const ShapeInfo& info_of(ShapeKind kind) { return kShapes[std::size_t(kind)]; }

std::vector<Shape> make_shapes(ShapeKind kind, std::span<const std::uint32_t> corners, const ShapeVertices& vertices,
                               const std::string& where) {
  const ShapeInfo& info = info_of(kind);
  check_radii(vertices.radii, where);
  const std::size_t given = corners.empty() ? vertices.positions.size() : corners.size();
  std::vector<Shape> shapes(given / info.vertices);
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const auto vertex = [&](std::size_t k) {
      const std::size_t at = i * info.vertices + k;
      return corners.empty() ? at : corners[at];
    };
    const auto sphere = [&](std::size_t v) {
      return glm::vec4(vertices.positions[v], info.radii ? vertices.radii[v] : 0);
    };
    const std::size_t first = vertex(0);
    shapes[i].a = sphere(first);
    if (kind == ShapeKind::Discs) shapes[i].b = glm::vec4(unit(vertices.normals[first], first, where), 0);
    if (kind == ShapeKind::Capsules) shapes[i].b = sphere(vertex(1));
    if (kind == ShapeKind::Boxes) {
      const glm::vec4 other = sphere(vertex(1));
      shapes[i] = {glm::min(shapes[i].a, other), glm::max(shapes[i].a, other)};
    }
  }
  return shapes;
}

Bounds bounds_of(ShapeKind kind, const Shape& s) {
  if (kind == ShapeKind::Boxes) return {glm::vec3(s.a), glm::vec3(s.b)};
  glm::dvec3 reach(s.a.w);
  if (kind == ShapeKind::Discs) {  // the normal is rounded, so its length is not 1
    const glm::dvec3 n(s.b), square = n * n;
    const double all = square.x + square.y + square.z;
    for (int k = 0; k < 3; ++k)
      reach[k] *= std::min(1.0, std::sqrt((square[(k + 1) % 3] + square[(k + 2) % 3]) / all) + 0x1p-21);
  }
  const Bounds a = around(s.a, reach);
  if (kind != ShapeKind::Capsules) return a;
  const Bounds b = around(s.b, glm::dvec3(s.b.w));
  return {glm::min(a.lo, b.lo), glm::max(a.hi, b.hi)};
}

bool is_nothing(ShapeKind kind, const Shape& s) {
  if (kind != ShapeKind::Boxes) return std::max(s.a.w, s.b.w) == 0;
  return (s.a.x == s.b.x) + (s.a.y == s.b.y) + (s.a.z == s.b.z) > 1;
}

Triangle stand_in(const Bounds& box) {
  Bounds wide = box;
  Triangle triangle = corners_for(box);
  const glm::vec3 far = glm::max(glm::abs(box.lo), glm::abs(box.hi));
  for (float room = std::max({far.x, far.y, far.z, 1e-30f}) * 0x1p-22f;
       has_no_area(triangle[0], triangle[1], triangle[2]); room *= 16) {
    wide = {box.lo - room, box.hi + room};
    triangle = corners_for(wide);
  }
  return triangle;
}

UnsetVector<Triangle> stand_ins(ShapeKind kind, std::span<const Shape> shapes) {
  UnsetVector<Triangle> all(shapes.size());
  for_chunks(shapes.size(), 1 << 14, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const glm::vec3 at(shapes[i].a);
      all[i] = is_nothing(kind, shapes[i]) ? Triangle{at, at, at} : stand_in(bounds_of(kind, shapes[i]));
    }
  });
  return all;
}

glm::vec3 normal_of_shape(float u, float v, const Transform& t) {
  glm::dvec3 n(2 * double(u) - 1, 2 * double(v) - 1, 0);
  n.z = 1 - std::abs(n.x) - std::abs(n.y);
  if (n.z < 0) {
    const double x = 1 - std::abs(n.y), y = 1 - std::abs(n.x);
    n.x = n.x < 0 ? -x : x;
    n.y = n.y < 0 ? -y : y;
  }
  double c[3][3];  // cofactors: the transposed inverse times the determinant
  for (int r = 0; r < 3; ++r)
    for (int k = 0; k < 3; ++k) {
      const int i = (r + 1) % 3, j = (r + 2) % 3, p = (k + 1) % 3, q = (k + 2) % 3;
      c[r][k] = double(t.m[i][p]) * t.m[j][q] - double(t.m[i][q]) * t.m[j][p];
    }
  const double det = t.m[0][0] * c[0][0] + t.m[0][1] * c[0][1] + t.m[0][2] * c[0][2];
  glm::dvec3 to;
  for (int r = 0; r < 3; ++r) to[r] = c[r][0] * n.x + c[r][1] * n.y + c[r][2] * n.z;
  if (det < 0) to = -to;
  return glm::vec3(to * inverse_root(to.x * to.x + to.y * to.y + to.z * to.z)) + 0.f;
}

}  // namespace ballot
