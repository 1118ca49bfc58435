#include "solids.h"

#include <map>

namespace solids {

namespace {

constexpr double kSize = 0.9;

/// Adds the profile (radius, height) of a body that is turned about the z axis, from its top on; the first and the last
/// point lie on the axis. `part` is by how much the radius shrinks in a column.
Solid turned(
    const std::vector<std::array<double, 2>>& profile, std::uint32_t columns,
    const std::function<double(std::uint32_t)>& part = [](std::uint32_t) { return 1.0; }) {
  Solid solid;
  const auto at = [&](std::uint32_t r, std::uint32_t c) {
    const double a = 2 * M_PI * c / columns, radius = profile[r][0] * part(c);
    return Vec{radius * std::cos(a), radius * std::sin(a), profile[r][1]};
  };
  add_poles(solid, std::uint32_t(profile.size() - 1), columns, {0, 0, profile.front()[1]}, {0, 0, profile.back()[1]},
            at);
  return solid;
}

Solid stretched(std::uint32_t rows, const Vec& by) {
  Solid solid;
  add_sphere(solid, rows, {0, 0, 0}, 1);
  for (std::size_t i = 0; i < solid.positions.size(); ++i) solid.positions[i] *= by[i % 3];
  return solid;
}

Solid of_faces(const std::vector<Vec>& vertices, const std::vector<std::uint32_t>& indices) {
  Solid solid;
  for (const Vec& v : vertices) solid.add(kSize * v);
  solid.indices = indices;
  return solid;
}

/// A tube of this radius about a closed curve of t in [0, 1).
Solid tube(std::uint32_t length, std::uint32_t around, double radius, const std::function<Vec(double)>& curve) {
  Solid solid;
  for (std::uint32_t i = 0; i < length; ++i) {
    const Vec at = curve(double(i) / length), next = curve((i + 0.01) / length);
    const Vec along = unit(next - at), side = unit(cross(along, {0.1, 0.2, 1})), up = cross(along, side);
    for (std::uint32_t k = 0; k < around; ++k) {
      const double a = 2 * M_PI * k / around;
      solid.add(at + radius * (std::cos(a) * side + std::sin(a) * up));
    }
  }
  for (std::uint32_t i = 0; i < length; ++i)
    for (std::uint32_t k = 0; k < around; ++k) {
      const std::uint32_t j = (i + 1) % length, l = (k + 1) % around;
      solid.quad(i * around + k, i * around + l, j * around + l, j * around + k);
    }
  return solid;
}

/// A cube of n x n squares a face, whose vertices are shared.
Solid cube(int n) {
  Solid solid;
  std::map<std::array<int, 3>, std::uint32_t> numbers;
  const auto number = [&](const std::array<int, 3>& at) {
    const auto [found, is_new] = numbers.try_emplace(at, std::uint32_t(numbers.size()));
    if (is_new) solid.add(kSize / n * Vec{2.0 * at[0] - n, 2.0 * at[1] - n, 2.0 * at[2] - n});
    return found->second;
  };
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const int end : {0, n})
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
          const auto at = [&](int a, int b) {
            std::array<int, 3> p{};
            p[axis] = end, p[(axis + 1) % 3] = end ? a : b, p[(axis + 2) % 3] = end ? b : a;
            return number(p);
          };
          solid.quad(at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
        }
  return solid;
}

/// A sphere whose rows are the finer the nearer they are to a pole, to 1e-10: float32 rounds many triangles flat.
Solid fine_pole() {
  Solid solid;
  const Vec centre{0.2, 0.1, 0};
  const auto at = [&](std::uint32_t r, std::uint32_t c) {
    const double a = 2.5 * std::pow(10.0, -double(20 - r) / 2), b = 2 * M_PI * c / 16;
    return centre + 0.6 * Vec{std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a)};
  };
  add_poles(solid, 21, 16, centre + Vec{0, 0, 0.6}, centre - Vec{0, 0, 0.6}, at);
  return solid;
}

/// A sphere whose radius differs from vertex to vertex.
Solid rough() {
  Solid solid;
  add_sphere(solid, 24, {0, 0, 0}, 1);
  std::mt19937 random(17);
  std::uniform_real_distribution<double> radius(0.3, kSize);
  for (std::size_t i = 0; i < solid.positions.size(); i += 3) {
    const double r = radius(random);
    for (std::size_t k = 0; k < 3; ++k) solid.positions[i + k] *= r;
  }
  return solid;
}

/// Spheres inside of each other, by their radii, wound outwards and inwards in turn.
Solid shells(const std::vector<double>& radii) {
  Solid solid;
  for (std::size_t i = 0; i < radii.size(); ++i) {
    const std::size_t first = solid.indices.size();
    add_sphere(solid, 12, {0, 0, 0}, radii[i]);
    if (i % 2)
      for (std::size_t k = first; k < solid.indices.size(); k += 3) std::swap(solid.indices[k], solid.indices[k + 1]);
  }
  return solid;
}

Vec ring(double t) { return {0.6 * std::cos(2 * M_PI * t), 0.6 * std::sin(2 * M_PI * t), 0}; }
Vec trefoil(double t) {
  const double a = 2 * M_PI * t;
  return 0.25 * Vec{std::sin(a) + 2 * std::sin(2 * a), std::cos(a) - 2 * std::cos(2 * a), -std::sin(3 * a)};
}

}  // namespace

std::vector<ClosedSolid> closed_solids() {
  const auto every = [](std::uint32_t n, double less) {
    return [n, less](std::uint32_t column) { return column % n ? less : 1.0; };
  };
  const Vec middle{0.01, 0.02, -0.015};
  return {
      {"tetrahedron",
       of_faces({{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}}, {0, 1, 2, 0, 2, 3, 0, 3, 1, 1, 3, 2}), middle, 1},
      {"octahedron",
       of_faces({{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}},
                {0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5}),
       middle, 1},
      {"cube", cube(1), middle, 1},
      {"cube of squares", cube(16), middle, 0.1},
      {"sphere with a fine pole", fine_pole(), middle, 1e-14},
      {"fine sphere", stretched(48, {kSize, kSize, kSize}), middle, 1e-3},
      {"rough sphere", rough(), middle, 1e-3},
      {"disc", stretched(16, {kSize, kSize, 1e-5}), {0.01, 0.02, 1e-6}, 1e-7},
      {"needle", stretched(16, {1e-5, 1e-5, kSize}), {1e-6, 2e-6, 0.01}, 1e-8},
      {"cylinder", turned({{0, kSize}, {0.4, kSize}, {0.4, -kSize}, {0, -kSize}}, 64), middle, 1e-2},
      {"cone", turned({{0, kSize}, {0.8, -kSize}, {0, -kSize}}, 64), middle, 1e-2},
      {"hourglass",
       turned({{0, kSize}, {0.8, kSize}, {1e-4, 0}, {0.8, -kSize}, {0, -kSize}}, 32),
       {0.01, 0.02, 0.5},
       1e-6},
      {"gear", turned({{0, 0.3}, {kSize, 0.3}, {kSize, -0.3}, {0, -0.3}}, 48, every(2, 0.6)), middle, 1e-2},
      {"star",
       turned({{0, kSize}, {0.1, 0.1}, {kSize, 0}, {0.1, -0.1}, {0, -kSize}}, 18, every(2, 0.05)),
       {0, 0, 0.05},
       1e-4},
      {"ring", tube(48, 24, 0.25, ring), ring(0.1) + 0.1 * middle, 1e-2},
      {"thin knot", tube(240, 8, 0.01, trefoil), trefoil(0.05), 1e-4},
      {"shells", shells({kSize, kSize - 1e-9, 0.5, 0.5 - 1e-7, 0.3}), middle, 1e-10},
  };
}

}  // namespace solids
