// Hard cases of trees, which are hard to build or to traverse: chains, equal boxes, equal centroids, triangles without
// area, a single triangle, none.
#include <cmath>

#include "tools/hard/generate.h"

namespace ballot::hard {

// Triangles whose sizes form a geometric progression: at each level a split by SAH cost separates the largest triangle
// from all others.
HardScene chain(bool quick) {
  Triangles mesh;
  float size = 0x1p-60f;
  for (Random random(80); size < 5e11f; size *= 1.25f) {
    const glm::vec3 a = random.direction() * size, b = random.direction() * size, c = random.direction() * size;
    mesh.push_back({a, b, c});
  }
  std::vector<HardRays> sets{{.name = "through all sizes"}, {.name = "away from the smallest"}};
  Random random(81);
  for (std::size_t i = 0; i < many(quick); ++i) {
    const glm::vec3 from = random.direction() * power_of_two(static_cast<int>(random.below(100)) - 61);
    const glm::vec3 to = target(mesh, random);
    sets[0].rays.push_back(towards(from, to));
    sets[1].rays.push_back({from * 0x1p-10f, 0, random.direction(), kFar});
  }
  return {scene_of("chain", std::move(mesh)), std::move(sets), {.max_leaf = 1, .split_budget = 0}};
}

HardScene same_box(bool quick) {
  Triangles mesh;
  Random random(82);
  for (int i = 0; i < (quick ? 500 : 2000); ++i) {
    const float r = random.in(0, 1), s = random.in(0, 1), t = random.in(0, 1);
    mesh.push_back({{{0, r, 1}, {1, 0, s}, {t, 1, 0}}});
  }
  std::vector<HardRays> sets{{.name = "around"}, {.name = "at vertices and edges"}};
  sets[0].rays = around(bounds_of(mesh), many(quick), 83);
  sets[1].rays = at_targets(mesh, many(quick), {0.5f, 0.5f, 0.5f}, 2, 84);
  return {scene_of("same-box", std::move(mesh)), std::move(sets), {.split_budget = 0}};
}

HardScene same_centroid(bool quick) {
  Triangles mesh;
  Random random(85);
  for (int i = 0; i < 300; ++i) {
    const glm::vec3 a = random.point(1), b = random.point(1);
    mesh.push_back({a, b, -a - b});
  }
  std::vector<HardRays> sets{{.name = "around"}, {.name = "at the centroid"}};
  sets[0].rays = around(bounds_of(mesh), many(quick), 86);
  // Few rays, because for each of them every triangle is a candidate at nearly the same t.
  for (std::size_t i = 0; i < many(quick) / 16; ++i) sets[1].rays.push_back(towards(random.point(2), {0, 0, 0}));
  return {scene_of("same-centroid", std::move(mesh)), std::move(sets)};
}

HardScene degenerate_among_proper(bool quick) {
  const Triangles sphere = octasphere(quick ? 3 : 5);
  Triangles mesh;
  Random random(87);
  for (const Triangle& t : sphere) {  // points, doubled edges and collinear vertices inside, on and outside the sphere
    const glm::vec3 a = t[0] * (0.5f * static_cast<float>(1 + random.below(3))), b = t[1];
    mesh.push_back({a, a, a});
    mesh.push_back({a, b, random.flip() ? a : b});
    mesh.push_back({glm::vec3(0), t[2] * 0.5f, t[2]});
    mesh.push_back(t);
  }
  std::vector<HardRays> sets{{.name = "from within", .closed = true}};
  sets[0].rays = at_targets(sphere, many(quick), {0, 0, 0}, 0.4f, 88);
  return {scene_of("degenerate-among-proper", std::move(mesh)), std::move(sets)};
}

HardScene only_degenerate(bool quick) {
  Triangles mesh;
  for (int i = 0; i < 20; ++i) {
    const glm::vec3 a(static_cast<float>(i), 0, 0), b(0, static_cast<float>(i), 1);
    mesh.insert(mesh.end(), {{a, a, a}, {a, b, a}, {glm::vec3(0), b, b * 2.f}});
  }
  HardRays set{.name = "through points and lines"};
  set.rays = at_targets(mesh, many(quick) / 5, {3, 3, 3}, 2, 89);
  set.answers = all(set.rays.size(), NO_HIT);
  return {scene_of("only-degenerate", std::move(mesh)), {std::move(set)}};
}

HardScene single_triangle(bool quick) {
  HardRays inside{.name = "at lattice points inside"}, outside{.name = "beside"},
      rim{.name = "at the rim", .closed = true};
  Random random(90);
  for (std::size_t i = 0; i < many(quick); ++i) {
    const auto x = static_cast<float>(1 + random.below(15)), rest = static_cast<float>(1 + random.below(15));
    const float z = std::fmin(rest, 31 - x) / 2, y = random.sign() * static_cast<float>(1 + random.below(8));
    inside.rays.push_back({{x, y, z}, 0, {0, y > 0 ? -1.f : 1.f, 0}, kFar});
    outside.rays.push_back({{-x, y, z}, 0, {0, y > 0 ? -1.f : 1.f, 0}, kFar});
    const glm::vec3 on_rim[] = {{x, y, 0}, {0, y, x}, {x, y, 32 - x}, {0, y, 0}, {32, y, 0}, {0, y, 32}};
    rim.rays.push_back({on_rim[random.below(6)], 0, {0, y > 0 ? -1.f : 1.f, 0}, kFar});
  }
  inside.answers = all(inside.rays.size(), 0);
  outside.answers = all(outside.rays.size(), NO_HIT);
  return {scene_of("single-triangle", {Triangle{{{0, 0, 0}, {0, 0, 32}, {32, 0, 0}}}}),
          {std::move(inside), std::move(outside), std::move(rim)}};
}

HardScene no_triangle(bool quick) {
  HardRays set{.name = "into nothing"};
  set.rays = around({{-1, -1, -1}, {1, 1, 1}}, many(quick) / 5, 91);
  set.answers = all(set.rays.size(), NO_HIT);
  return {scene_of("no-triangle", {}), {std::move(set)}};
}

}  // namespace ballot::hard
