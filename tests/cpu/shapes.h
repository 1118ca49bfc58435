// Small scenes and sets of rays for tests. They are the same on every run.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>
#include <random>
#include <vector>

#include "engine/model/scene.h"
#include "shaders/shared/layout.h"

namespace ballot::shapes {

using Triangles = UnsetVector<Triangle>;

class Random {
 public:
  explicit Random(std::uint32_t seed) : world_(seed) {}
  float in(float lo, float hi) { return lo + (hi - lo) * static_cast<float>(world_() >> 8) * 0x1p-24f; }
  glm::vec3 point(float half) {
    const float x = in(-half, half), y = in(-half, half), z = in(-half, half);
    return {x, y, z};
  }
  std::size_t below(std::size_t n) { return world_() % n; }

 private:
  std::mt19937 world_;
};

/// Random triangles of about `size` in a cube of half width 1.
inline Triangles soup(std::size_t count, float size, std::uint32_t seed = 1) {
  Random random(seed);
  Triangles out;
  for (std::size_t i = 0; i < count; ++i) {
    const glm::vec3 c = random.point(1);
    const glm::vec3 a = random.point(size), b = random.point(size), d = random.point(size);
    out.push_back({c + a, c + b, c + d});
  }
  return out;
}

/// Triangles between points of a coarse grid whose origin and spacing are rounded. So many vertices lie next to the
/// planes that a builder splits at, off by the last digits.
inline Triangles rounded_grid(std::uint32_t seed) {
  Random random(seed);
  const int steps = 1 + static_cast<int>(random.below(4));
  const float spacing = random.in(0.1f, 3);
  const glm::vec3 origin = random.point(5);
  const std::size_t count = 30 + random.below(90);
  const auto corner = [&] {
    glm::vec3 p = origin;
    for (int k = 0; k < 3; ++k) p[k] += spacing * static_cast<float>(random.below(steps + 1));
    return p;
  };
  Triangles out(count);
  for (Triangle& t : out)
    for (glm::vec3& p : t) p = corner();
  return out;
}

/// A wavy height field of 2 * side * side triangles over [-1, 1] squared.
inline Triangles grid(int side, float height = 0.1f) {
  const auto at = [&](int i, int j) {
    const float x = 2 * static_cast<float>(i) / static_cast<float>(side) - 1;
    const float z = 2 * static_cast<float>(j) / static_cast<float>(side) - 1;
    return glm::vec3(x, height * std::sin(7 * x) * std::cos(5 * z), z);
  };
  Triangles out;
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i) {
      out.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      out.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return out;
}

/// A closed octahedron, each face divided `levels` times, its vertices on the unit sphere.
inline Triangles sphere(int levels) {
  const glm::vec3 x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
  Triangles out{{x, y, z}, {y, -x, z}, {-x, -y, z}, {-y, x, z}, {y, x, -z}, {-x, y, -z}, {-y, -x, -z}, {x, -y, -z}};
  for (int level = 0; level < levels; ++level) {
    Triangles finer;
    for (const auto& [a, b, c] : out) {
      const glm::vec3 ab = glm::normalize(a + b), bc = glm::normalize(b + c), ca = glm::normalize(c + a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    out = std::move(finer);
  }
  return out;
}

/// A closed box of twelve triangles, wound outwards.
inline Triangles box(const glm::vec3& lo, const glm::vec3& hi) {
  const auto at = [&](int i) { return glm::vec3(i & 1 ? hi.x : lo.x, i & 2 ? hi.y : lo.y, i & 4 ? hi.z : lo.z); };
  constexpr int kSides[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  Triangles out;
  for (const auto& s : kSides) {
    out.push_back({at(s[0]), at(s[1]), at(s[2])});
    out.push_back({at(s[0]), at(s[2]), at(s[3])});
  }
  return out;
}

inline Triangles joined(Triangles a, const Triangles& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

inline Triangles identical(std::size_t count) { return Triangles(count, Triangle{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}}); }

/// Overlapping triangles in the plane z = 0.5.
inline Triangles coplanar(std::size_t count) {
  Triangles out = soup(count, 0.3f, 3);
  for (Triangle& t : out)
    for (glm::vec3& v : t) v.z = 0.5f;
  return out;
}

/// Triangles of many sizes and orientations about a common centroid.
inline Triangles same_centroid(std::size_t count) {
  Random random(4);
  Triangles out;
  for (std::size_t i = 0; i < count; ++i) {
    const glm::vec3 a = random.point(1), b = random.point(1);
    out.push_back({a, b, -a - b});
  }
  return out;
}

/// Long thin triangles in all directions.
inline Triangles slivers(std::size_t count) {
  Random random(5);
  Triangles out;
  for (std::size_t i = 0; i < count; ++i) {
    const glm::vec3 a = random.point(1), b = random.point(1);
    out.push_back({a, b, b + random.point(1e-4f)});
  }
  return out;
}

/// Triangles of sizes from 1e-4 to 1e4 about the origin.
inline Triangles huge_and_tiny(std::size_t count) {
  Random random(6);
  Triangles out;
  for (std::size_t i = 0; i < count; ++i) {
    const float size = std::pow(10.f, random.in(-4, 4));
    out.push_back({random.point(size), random.point(size), random.point(size)});
  }
  return out;
}

inline Triangles moved(Triangles triangles, const glm::vec3& by) {
  for (Triangle& t : triangles)
    for (glm::vec3& v : t) v += by;
  return triangles;
}

inline Triangles scaled(Triangles triangles, float by) {
  for (Triangle& t : triangles)
    for (glm::vec3& v : t) v *= by;
  return triangles;
}

inline Ray towards(const glm::vec3& from, const glm::vec3& to, float t_max = 1e30f) {
  return {from, 0, to - from, t_max};
}

/// Rays in all directions, from points in and about the cube of half width 2.
inline std::vector<Ray> random_rays(std::size_t count, std::uint32_t seed = 7, float half = 2) {
  Random random(seed);
  std::vector<Ray> out;
  while (out.size() < count) {
    const glm::vec3 from = random.point(half), to = random.point(half / 2);
    out.push_back(towards(from, to));
  }
  return out;
}

/// Rays along the axes, with 0 and -0 as the other components of the direction, from and through points of the
/// triangles.
inline std::vector<Ray> axis_rays(const Triangles& triangles, std::size_t count) {
  Random random(8);
  std::vector<Ray> out;
  while (out.size() < count) {
    const Triangle& t = triangles[random.below(triangles.size())];
    const glm::vec3 middle = (t[0] + t[1] + t[2]) / 3.f;
    const int axis = static_cast<int>(random.below(3));
    glm::vec3 dir(random.below(2) == 0 ? 0.f : -0.f);
    dir[axis] = random.below(2) == 0 ? 1.f : -1.f;
    const glm::vec3 through = random.below(2) == 0 ? t[random.below(3)] : middle;
    out.push_back({random.below(3) == 0 ? through : through - dir * 3.f, 0, dir, 1e30f});
  }
  return out;
}

/// Rays from points near `from` to vertices and to points on edges. They start inside the shape if `from` does.
inline std::vector<Ray> edge_rays(const Triangles& triangles, std::size_t count, const glm::vec3& from) {
  Random random(9);
  std::vector<Ray> out;
  while (out.size() < count) {
    const Triangle& t = triangles[random.below(triangles.size())];
    const std::size_t k = random.below(3);
    const float s = random.below(2) == 0 ? 0.f : random.in(0, 1);
    out.push_back(towards(from + random.point(0.01f), t[k] + (t[(k + 1) % 3] - t[k]) * s));
  }
  return out;
}

inline std::vector<Ray> dead_rays() {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  const glm::vec3 o(0, 0, -5), z(0, 0, 1);
  return {{{nan, 0, 0}, 0, z, 10},
          {{0, inf, 0}, 0, z, 10},
          {o, nan, z, 10},
          {o, 0, z, nan},
          {o, 0, z, inf},
          {o, 0, {0, nan, 1}, 10},
          {o, 0, {0, 0, inf}, 10},
          {o, 0, {0, 0, 0}, 10},
          {o, 0, {0, -0.f, 1e-40f}, 10},
          {o, 5, z, 5},
          {o, 6, z, 5}};
}

/// Returns the largest distance of a vertex from a point.
inline double reach_of(const glm::vec3& p, const Triangle& t) {
  double most = 0;
  for (const glm::vec3& v : t) most = std::max(most, glm::length(glm::dvec3(v) - glm::dvec3(p)));
  return most;
}

}  // namespace ballot::shapes
