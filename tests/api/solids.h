// Closed meshes in double.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <vector>

#include "api.h"

namespace solids {

using Vec = std::array<double, 3>;

inline Vec operator+(const Vec& a, const Vec& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
inline Vec operator-(const Vec& a, const Vec& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline Vec operator*(double s, const Vec& a) { return {s * a[0], s * a[1], s * a[2]}; }
inline double dot(const Vec& a, const Vec& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Vec cross(const Vec& a, const Vec& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline Vec unit(const Vec& a) { return 1 / std::sqrt(dot(a, a)) * a; }

/// A mesh in double.
struct Solid {
  std::vector<double> positions;
  std::vector<std::uint32_t> indices;

  Vec at(std::size_t vertex) const {
    return {positions[3 * vertex], positions[3 * vertex + 1], positions[3 * vertex + 2]};
  }
  void add(const Vec& v) { positions.insert(positions.end(), v.begin(), v.end()); }
  void quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    indices.insert(indices.end(), {a, b, c, a, c, d});
  }
  ballot::Mesh mesh() const { return ballot::mesh(positions, indices); }
};

/// Adds a closed grid about the z axis, wound outwards: `at` places row 1 to rows - 1 of each column; rows 0 and `rows`
/// are its poles.
template <class At>
void add_poles(Solid& to, std::uint32_t rows, std::uint32_t columns, const Vec& top, const Vec& bottom, const At& at) {
  const auto first = std::uint32_t(to.positions.size() / 3);
  to.add(top);
  for (std::uint32_t r = 1; r < rows; ++r)
    for (std::uint32_t c = 0; c < columns; ++c) to.add(at(r, c));
  to.add(bottom);
  const std::uint32_t last = first + 1 + (rows - 1) * columns;
  const auto number = [&](std::uint32_t r, std::uint32_t c) {
    return r == 0 ? first : r == rows ? last : first + 1 + (r - 1) * columns + c % columns;
  };
  for (std::uint32_t r = 0; r < rows; ++r)
    for (std::uint32_t c = 0; c < columns; ++c) {
      if (r > 0) to.indices.insert(to.indices.end(), {number(r, c), number(r + 1, c), number(r, c + 1)});
      if (r + 1 < rows) to.indices.insert(to.indices.end(), {number(r, c + 1), number(r + 1, c), number(r + 1, c + 1)});
    }
}

/// Adds a sphere of rows x 2 rows squares.
inline void add_sphere(Solid& to, std::uint32_t rows, const Vec& centre, double radius) {
  const auto at = [&](std::uint32_t r, std::uint32_t c) {
    const double a = M_PI * r / rows, b = M_PI * c / rows;
    return centre + radius * Vec{std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a)};
  };
  add_poles(to, rows, 2 * rows, centre + Vec{0, 0, radius}, centre - Vec{0, 0, radius}, at);
}

/// A closed mesh in [-0.9, 0.9]^3.
struct ClosedSolid {
  const char* name;
  Solid solid;
  Vec within;     // a point inside
  double finest;  // the smallest width of it, or of a triangle
};

/// Returns meshes of all kinds: convex and not, with holes, thin, spiky, with nearly touching walls.
std::vector<ClosedSolid> closed_solids();

}  // namespace solids
