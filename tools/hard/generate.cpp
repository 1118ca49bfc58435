#include "tools/hard/generate.h"

#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

namespace ballot::hard {
namespace {

// Divides each triangle into four and puts the new vertices at distance 1. a + b equals b + a in floating point, so
// neighbours agree on the middle of an edge.
Triangles divided(const Triangles& coarse) {
  const auto middle = [](const glm::vec3& a, const glm::vec3& b) {
    const glm::vec3 m = a + b;
    return m / std::sqrt(m.x * m.x + m.y * m.y + m.z * m.z);
  };
  Triangles fine;
  for (const auto& [a, b, c] : coarse) {
    const glm::vec3 ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    fine.insert(fine.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
  }
  return fine;
}

std::uint32_t scramble(std::uint32_t x) {
  x = (x ^ x >> 16) * 0x7FEB352Du;
  x = (x ^ x >> 15) * 0x846CA68Bu;
  return x ^ x >> 16;
}

float lattice(int x, int y, int z, std::uint32_t seed) {
  const std::uint32_t h = scramble(scramble(scramble(scramble(seed) + unsigned(x)) + unsigned(y)) + unsigned(z));
  return static_cast<float>(h >> 8) * 0x1p-23f - 1;
}

float mix(float a, float b, float s) { return a + (b - a) * s; }

}  // namespace

std::uint32_t Random::bits() {
  std::uint64_t z = state_ += 0x9E3779B97F4A7C15u;
  z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
  z = (z ^ z >> 27) * 0x94D049BB133111EBu;
  return static_cast<std::uint32_t>(z >> 32);
}

glm::vec3 Random::point(float half) {
  const float x = in(-half, half), y = in(-half, half), z = in(-half, half);
  return {x, y, z};
}

glm::vec3 Random::direction() {
  for (;;) {
    const glm::vec3 d = point(1);
    const float length2 = d.x * d.x + d.y * d.y + d.z * d.z;
    if (length2 >= 0.25f && length2 <= 1) return d;
  }
}

float beside(float x, Random& random) {
  const std::size_t way = random.below(3);
  return way == 0 ? x : std::nextafter(x, way == 1 ? kInf : -kInf);
}

glm::vec3 beside(const glm::vec3& p, Random& random) {
  const float x = beside(p.x, random), y = beside(p.y, random), z = beside(p.z, random);
  return {x, y, z};
}

float power_of_two(int exponent) { return std::ldexp(1.f, exponent); }

Bounds bounds_of(const Triangles& triangles) {
  if (triangles.empty()) return {};
  Bounds b{triangles[0][0], triangles[0][0]};
  for (const Triangle& t : triangles)
    for (const glm::vec3& v : t) b = {glm::min(b.lo, v), glm::max(b.hi, v)};
  return b;
}

Scene scene_of(std::string name, Triangles triangles) {
  Scene scene;
  scene.name = std::move(name);
  scene.triangles = std::move(triangles);
  finish_scene(scene);
  return scene;
}

Triangles octasphere(int levels) {
  const glm::vec3 x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
  Triangles mesh{{x, y, z}, {y, -x, z}, {-x, -y, z}, {-y, x, z}, {y, x, -z}, {-x, y, -z}, {-y, -x, -z}, {x, -y, -z}};
  for (int i = 0; i < levels; ++i) mesh = divided(mesh);
  return mesh;
}

Triangles icosphere(int levels) {
  const float a = 0.525731112f, b = 0.850650808f;
  const glm::vec3 v[] = {{-a, b, 0},  {a, b, 0},  {-a, -b, 0}, {a, -b, 0}, {0, -a, b},  {0, a, b},
                         {0, -a, -b}, {0, a, -b}, {b, 0, -a},  {b, 0, a},  {-b, 0, -a}, {-b, 0, a}};
  const int faces[][3] = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                          {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                          {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  Triangles mesh;
  for (const auto& f : faces) mesh.push_back({v[f[0]], v[f[1]], v[f[2]]});
  for (int i = 0; i < levels; ++i) mesh = divided(mesh);
  return mesh;
}

Triangles plane_grid(int n, float half, float y) {
  const auto at = [&](int i, int j) {
    const float step = 2 * half / static_cast<float>(n);
    return glm::vec3(-half + step * static_cast<float>(i), y, -half + step * static_cast<float>(j));
  };
  Triangles mesh;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      mesh.push_back({at(i, j), at(i, j + 1), at(i + 1, j + 1)});
      mesh.push_back({at(i, j), at(i + 1, j + 1), at(i + 1, j)});
    }
  return mesh;
}

Triangles cube_grid(int n, float half) {
  Triangles mesh;
  for (const float y : {-half, half})
    for (const auto& [a, b, c] : plane_grid(n, half, y))
      for (int axis = 0; axis < 3; ++axis) {
        const auto turned = [&](const glm::vec3& p) {
          return axis == 0 ? p : axis == 1 ? glm::vec3(p.y, p.z, p.x) : glm::vec3(p.z, p.x, p.y);
        };
        mesh.push_back({turned(a), turned(b), turned(c)});
      }
  return mesh;
}

Triangles soup(std::size_t count, float size, std::uint64_t seed) {
  Random random(seed);
  Triangles mesh;
  for (std::size_t i = 0; i < count; ++i) {
    const glm::vec3 centre = random.point(1), a = random.point(size), b = random.point(size), c = random.point(size);
    mesh.push_back({centre + a, centre + b, centre + c});
  }
  return mesh;
}

Triangles moved(Triangles triangles, float scale, const glm::vec3& offset) {
  for (Triangle& t : triangles)
    for (glm::vec3& v : t) v = v * scale + offset;
  return triangles;
}

void append(Triangles& to, const Triangles& more) { to.insert(to.end(), more.begin(), more.end()); }

float noise(const glm::vec3& p, std::uint32_t seed) {
  const glm::vec3 cell(std::floor(p.x), std::floor(p.y), std::floor(p.z)), f = p - cell;
  const glm::vec3 s = f * f * (glm::vec3(3) - f * 2.f);
  const int x = static_cast<int>(cell.x), y = static_cast<int>(cell.y), z = static_cast<int>(cell.z);
  float slice[2];
  for (const int k : {0, 1})
    slice[k] = mix(mix(lattice(x, y, z + k, seed), lattice(x + 1, y, z + k, seed), s.x),
                   mix(lattice(x, y + 1, z + k, seed), lattice(x + 1, y + 1, z + k, seed), s.x), s.y);
  return mix(slice[0], slice[1], s.z);
}

Ray towards(const glm::vec3& from, const glm::vec3& to, float t_max) { return {from, 0, to - from, t_max}; }

glm::vec3 point_of(const Triangle& t, float u, float v) { return t[0] + (t[1] - t[0]) * u + (t[2] - t[0]) * v; }

glm::vec3 target(const Triangles& triangles, Random& random) {
  const Triangle& t = triangles[random.below(triangles.size())];
  const std::size_t k = random.below(3);
  switch (random.below(3)) {
    case 0:
      return t[k];
    case 1:
      return t[k] + (t[(k + 1) % 3] - t[k]) * random.in(0, 1);
    default: {
      const float u = random.in(0, 1), v = random.in(0, 1 - u);
      return point_of(t, u, v);
    }
  }
}

std::vector<Ray> at_targets(const Triangles& triangles, std::size_t count, const glm::vec3& centre, float spread,
                            std::uint64_t seed) {
  Random random(seed);
  std::vector<Ray> rays;
  while (rays.size() < count) {
    const glm::vec3 from = random.flip() ? centre : centre + random.point(spread * 0.577f);
    rays.push_back(towards(from, target(triangles, random)));
  }
  return rays;
}

std::vector<Ray> axes_from_within(const Triangles& triangles, std::size_t count, const glm::vec3& centre, float radius,
                                  std::uint64_t seed) {
  Random random(seed);
  std::vector<Ray> rays;
  while (rays.size() < count) {
    const glm::vec3 v = triangles[random.below(triangles.size())][random.below(3)];
    const int axis = static_cast<int>(random.below(3));
    const float depth = v[axis] - centre[axis];
    if (std::abs(depth) < 0.2f * radius) continue;
    glm::vec3 from = v, dir;
    from[axis] = centre[axis];
    for (int k = 0; k < 3; ++k) dir[k] = random.flip() ? 0.f : -0.f;
    dir[axis] = depth > 0 ? 1.f : -1.f;
    rays.push_back({from, 0, dir, kFar});
  }
  return rays;
}

std::vector<Ray> around(const Bounds& bounds, std::size_t count, std::uint64_t seed) {
  Random random(seed);
  const glm::vec3 centre = bounds.lo * 0.5f + bounds.hi * 0.5f, half = bounds.hi * 0.5f - bounds.lo * 0.5f;
  std::vector<Ray> rays;
  while (rays.size() < count) {
    const glm::vec3 a = random.point(1.5f), b = random.point(1);
    rays.push_back(towards(centre + half * a, centre + half * b));
  }
  return rays;
}

std::vector<std::uint32_t> all(std::size_t count, std::uint32_t answer) {
  return std::vector<std::uint32_t>(count, answer);
}

}  // namespace ballot::hard
