// What rays and points meet of shapes, by brute force in long double: each shape is where a convex function is not
// positive, so what a ray has of it lies between the function's zeros on both sides of its least value.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "engine/model/scene.h"
#include "shaders/shared/layout.h"
#include "tests/cpu/shapes.h"

namespace ballot::test {

using Number = long double;
using Vector = std::array<Number, 3>;

inline Vector vector(const glm::vec3& v) { return {v.x, v.y, v.z}; }
inline Vector minus(const Vector& a, const Vector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline Number product(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Number length(const Vector& a) { return std::sqrt(product(a, a)); }

/// Returns how far a point is outside of a closed shape. Inside it is below zero, of a box minus the distance from the
/// nearest face. A capsule is all spheres between its ends: the least over these, whose place is found by its
/// derivative.
inline Number outside(ShapeKind kind, const Shape& s, const Vector& p) {
  const Vector a = vector(s.a), b = vector(s.b);
  if (kind == ShapeKind::Spheres) return length(minus(p, a)) - s.a.w;
  if (kind == ShapeKind::Boxes) {
    Number most = -std::numeric_limits<Number>::infinity(), beyond = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const Number out = std::max(a[k] - p[k], p[k] - b[k]);
      most = std::max(most, out);
      if (out > 0) beyond += out * out;
    }
    return most > 0 ? std::sqrt(beyond) : most;
  }
  const Vector axis = minus(b, a), from = minus(p, a);
  const Number size = length(axis), grows = size > 0 ? (Number(s.b.w) - s.a.w) / size : 0;
  const auto at = [&](Number x) {
    Vector to = from;
    for (std::size_t k = 0; k < 3; ++k) to[k] -= size > 0 ? axis[k] * (x / size) : 0;
    return length(to) - (s.a.w + grows * x);
  };
  Number least = std::min(at(0), at(size));
  if (size > 0 && std::abs(grows) < 1) {
    const Number y = product(from, axis) / size;
    const Number across = std::sqrt(std::max<Number>(0, product(from, from) - y * y));
    const Number x = y + across * grows / std::sqrt(1 - grows * grows);
    if (x > 0 && x < size) least = std::min(least, at(x));
  }
  return least;
}

/// The part of a ray within a range: the t of the least value of outside() there, and that value.
struct Deepest {
  Number t, value;
};
inline Deepest deepest(ShapeKind kind, const Shape& s, const Ray& ray, Number from, Number to) {
  const auto at = [&](Number t) {
    return outside(kind, s, {ray.origin.x + t * ray.dir.x, ray.origin.y + t * ray.dir.y, ray.origin.z + t * ray.dir.z});
  };
  for (int i = 0; i < 120; ++i) {
    const Number x = from + (to - from) * 0.38196601L, y = from + (to - from) * 0.61803399L;
    (at(x) < at(y) ? to : from) = at(x) < at(y) ? y : x;
  }
  const Number t = (from + to) / 2;
  return {t, at(t)};
}

/// Returns random shapes of a kind within a cube of half width 1, of about `size`. Some capsules are cones, some have
/// an end within the other, some boxes are flat.
inline std::vector<Shape> random_shapes(ShapeKind kind, std::size_t count, float size, std::uint32_t seed) {
  shapes::Random random(seed);
  std::vector<Shape> all;
  for (std::size_t i = 0; i < count; ++i) {
    const glm::vec3 c = random.point(1), d = random.point(2 * size);
    const float r = random.in(0.1f, 1) * size, q = i % 3 == 0 ? r : random.in(0, 1.5f) * size;
    Shape s{{c, r}, {c + d, q}};
    if (kind == ShapeKind::Spheres) s.b = glm::vec4(0);
    if (kind == ShapeKind::Discs) s.b = glm::vec4(glm::normalize(d), 0);
    if (kind == ShapeKind::Boxes) {
      s = {{glm::min(c, c + d), 0}, {glm::max(c, c + d), 0}};
      if (i % 5 == 0) s.b[int(i / 5 % 3)] = s.a[int(i / 5 % 3)];
    }
    all.push_back(s);
  }
  return all;
}

/// A mesh of shapes, or of triangles.
struct ShapeMesh {
  ShapeKind kind = ShapeKind::Triangles;
  std::vector<Shape> shapes = {};
  UnsetVector<Triangle> triangles = {};
};

/// Returns a scene of meshes with these placements.
inline Scene scene_of(std::vector<ShapeMesh> meshes, std::vector<Placement> placements) {
  Scene scene;
  scene.name = "shapes";
  for (ShapeMesh& m : meshes) {
    scene.instances.first.push_back(scene.triangles.size());
    scene.instances.mesh_labels.push_back({.id = std::uint32_t(scene.instances.mesh_labels.size()), .kind = m.kind});
    if (m.kind != ShapeKind::Triangles) m.triangles = stand_ins(m.kind, m.shapes);
    m.shapes.resize(m.triangles.size());
    scene.triangles.insert(scene.triangles.end(), m.triangles.begin(), m.triangles.end());
    scene.shapes.insert(scene.shapes.end(), m.shapes.begin(), m.shapes.end());
  }
  scene.instances.first.push_back(scene.triangles.size());
  scene.instances.placements = std::move(placements);
  scene.instances.placed = true;
  finish_scene(scene);
  return scene;
}

}  // namespace ballot::test
