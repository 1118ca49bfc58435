// Judges hits of shapes and triangles by brute force in long double: whether an answer lies within a distance `room` of
// what it names, and whether something was surely met before.
#pragma once

#include "engine/oracle/oracle_scene.h"
#include "tests/cpu/shape_truth.h"

namespace ballot::test {

inline constexpr Number kUlp = 0x1p-24L;

/// Returns the largest distance along an axis from a ray's origin that a test of a shape or a triangle deals with.
inline Number reach_of(const Ray& ray, Number t, const Shape& s, const Triangle& stand_in) {
  Number most = 0;
  for (int k = 0; k < 3; ++k) {
    most = std::max(
        {most, std::abs(t * ray.dir[k]), std::abs(Number(s.a[k]) - ray.origin[k]), Number(s.a.w), Number(s.b.w)});
    for (const glm::vec3& v : stand_in) most = std::max(most, std::abs(Number(v[k]) - ray.origin[k]));
  }
  return most;
}

/// Where a ray meets the plane of a disc or a triangle, how far within its edge, and the sine of the angle. Where there
/// is no such point, t is not a number.
struct Pierced {
  Number t, within, sine;
};
inline Pierced pierce_disc(const Ray& ray, const Shape& s) {
  const Vector n = vector(s.b), from = minus(vector(s.a), vector(ray.origin)), d = vector(ray.dir);
  const Number along = product(d, n), t = product(from, n) / along;
  return {t, s.a.w - length(minus(Vector{t * d[0], t * d[1], t * d[2]}, from)), std::abs(along) / length(d)};
}
inline Vector cross_of(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline Pierced pierce_triangle(const Ray& ray, const Triangle& triangle) {
  const Vector d = vector(ray.dir), o = vector(ray.origin);
  Vector v[3];
  for (std::size_t i = 0; i < 3; ++i) v[i] = minus(vector(triangle[i]), o);
  Vector n = cross_of(minus(v[1], v[0]), minus(v[2], v[0]));
  const Number size = length(n);
  for (Number& x : n) x /= size;
  const Number along = product(d, n), t = product(v[0], n) / along;
  const Vector at{t * d[0], t * d[1], t * d[2]};
  Number within = std::numeric_limits<Number>::infinity();
  for (std::size_t i = 0; i < 3; ++i) {
    const Vector edge = minus(v[(i + 1) % 3], v[i]);
    within = std::min(within, product(cross_of(edge, minus(at, v[i])), n) / length(edge));
  }
  return {t, within, std::abs(along) / length(d)};
}

/// What an answer says of a ray in the space of a mesh: it ends at t.
struct Claim {
  Ray ray;
  Number t, unit;  // the length of the direction
};

/// Returns true if the claim's end lies on a shape or a triangle.
inline bool is_on(const PlacedMesh& mesh, std::size_t i, const Claim& c, Number room) {
  if (mesh.kind != ShapeKind::Triangles && mesh.kind != ShapeKind::Discs)
    return std::abs(deepest(mesh.kind, mesh.shapes[i], c.ray, c.t, c.t).value) <= room;
  const Pierced p =
      mesh.kind == ShapeKind::Discs ? pierce_disc(c.ray, mesh.shapes[i]) : pierce_triangle(c.ray, mesh.triangles[i]);
  const Number slant = room / p.sine;
  return std::abs(p.t - c.t) * c.unit <= slant && p.within >= -slant;
}

/// Returns true if the line of a ray surely passes by a shape: by a ball around its bounds, which the triangle that
/// stands in for it has, wider by the room.
inline bool passes_by(const Triangle& stand_in, const Ray& ray, Number room) {
  const Vector lo = vector(stand_in[0]), size = minus(vector(stand_in[1]), lo), d = vector(ray.dir);
  Vector to = minus(lo, vector(ray.origin));
  for (std::size_t k = 0; k < 3; ++k) to[k] += size[k] / 2;
  return length(cross_of(to, d)) > (length(size) / 2 + room) * 1.001L * length(d);
}

/// Returns true if the ray has met a shape or a triangle before, by more than the room.
inline bool is_passed(const PlacedMesh& mesh, std::size_t i, const Claim& c, Number room) {
  if (mesh.kind != ShapeKind::Triangles &&
      (is_nothing(mesh.kind, mesh.shapes[i]) || passes_by(mesh.triangles[i], c.ray, room)))
    return false;
  if (mesh.kind == ShapeKind::Triangles || mesh.kind == ShapeKind::Discs) {
    const Pierced p =
        mesh.kind == ShapeKind::Discs ? pierce_disc(c.ray, mesh.shapes[i]) : pierce_triangle(c.ray, mesh.triangles[i]);
    const Number slant = room / p.sine, off = slant / c.unit;
    return p.within > slant && p.t > c.ray.t_min + off && p.t < c.t - off;
  }
  const Shape& s = mesh.shapes[i];
  const auto at = [&](Number t) { return deepest(mesh.kind, s, c.ray, t, t).value; };
  if (at(c.ray.t_min) < -room) return at(c.t) > room;
  return c.t - room / c.unit > c.ray.t_min &&
         deepest(mesh.kind, s, c.ray, c.ray.t_min, c.t - room / c.unit).value < -room;
}

/// Returns what is wrong with a hit, or nothing. Rooms are `ulps` times 2^-24 of reach_of().
inline std::string fault_of(const OracleScene& scene, const Ray& ray, const Hit& hit, Number ulps) {
  std::string fault;
  const auto claim = [&](const PlacedMesh& mesh) {
    const Number end = hit.prim == NO_HIT ? ray.t_max : hit.t;
    return Claim{rounded(mesh.ray), end / mesh.scale, length(vector(mesh.ray.dir))};
  };
  const auto room = [&](const PlacedMesh& mesh, std::size_t i, const Claim& c) {
    const Number near = std::min(c.t, 16 / c.unit);  // what lies there is at hand
    return ulps * kUlp * reach_of(c.ray, near, mesh.shapes.empty() ? Shape{} : mesh.shapes[i], mesh.triangles[i]);
  };
  if (hit.prim != NO_HIT) {
    const PlacedMesh mesh = scene.mesh_of(ray, hit.prim);
    const Claim c = claim(mesh);
    const std::size_t own = hit.prim - mesh.first;
    const Number far = ulps * kUlp * reach_of(c.ray, c.t, Shape{}, mesh.triangles[own]);
    if (!is_on(mesh, own, c, far)) fault = fmt::format("off the surface of prim {}", hit.prim);
  }
  scene.for_each(ray, [&](const PlacedMesh& mesh) {
    const Claim c = claim(mesh);
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
      if (is_passed(mesh, i, c, room(mesh, i, c))) fault = fmt::format("prim {} comes before", mesh.first + i);
  });
  return fault;
}

}  // namespace ballot::test
