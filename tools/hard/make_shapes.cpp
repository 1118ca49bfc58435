// Hard cases of shape and overlap: needles, planes seen edge-on, duplicates, overlapping triangles, flat walls.
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "tools/hard/generate.h"

namespace ballot::hard {
namespace {

/// Returns three walls of 8 x 8 unit squares, across the positive axes at 8. The prims of the wall of axis k begin at
/// 128 k.
Triangles walls() {
  Triangles mesh;
  for (int axis = 0; axis < 3; ++axis)
    for (const Triangle& t : plane_grid(8, 4, 8)) {
      Triangle turned = t;
      for (glm::vec3& v : turned) v = axis == 1 ? v : axis == 2 ? glm::vec3(v.z, v.x, v.y) : glm::vec3(v.y, v.z, v.x);
      mesh.push_back(turned);
    }
  return mesh;
}

/// Returns a ray along an axis at a point inside a triangle of walls(), and the triangle's number in `prim`.
Ray at_wall(Random& random, std::uint32_t& prim) {
  const std::size_t axis = random.below(3), cell = random.below(64);
  const bool second = random.flip();
  const float x = static_cast<float>(cell % 8) - 4 + (second ? 0.75f : 0.25f);
  const float z = static_cast<float>(cell / 8) - 4 + (second ? 0.25f : 0.75f);
  const float y = static_cast<float>(random.below(8)), length = power_of_two(static_cast<int>(random.below(9)) - 4);
  prim = static_cast<std::uint32_t>(128 * axis + 2 * cell + (second ? 1 : 0));
  const glm::vec3 p = axis == 1 ? glm::vec3(x, y, z) : axis == 2 ? glm::vec3(z, x, y) : glm::vec3(y, z, x);
  glm::vec3 dir(0);
  dir[static_cast<int>(axis)] = length;
  return {p, 0, dir, kFar};
}

}  // namespace

// The box of an axis-parallel triangle has no thickness: the entry and exit distances of its slab are equal.
HardScene flat_walls(bool quick) {
  std::vector<HardRays> sets{{.name = "along the axes"}, {.name = "any hit", .want = Want::Any}, {.name = "oblique"}};
  Random random(60);
  for (HardRays* set : {&sets[0], &sets[1]})
    for (std::size_t i = 0; i < many(quick); ++i) {
      std::uint32_t prim = 0;
      set->rays.push_back(at_wall(random, prim));
      set->answers.push_back(prim);
    }
  Triangles mesh = walls();
  sets[2].rays = at_targets(mesh, many(quick), {0, 0, 0}, 5, 61);
  return {scene_of("flat-walls", std::move(mesh)), std::move(sets)};
}

// Needles whose long edges pass by zero at a distance that doubles of their length do not resolve, and a closed
// tetrahedron, one edge of which is such a needle: its prims are 0 to 4, and the needle is 4.
HardScene hairs(bool quick) {
  constexpr float kWidth = 1e-20f;
  const glm::vec3 b(-1, -1, 0), c(1, 1, 0), d(-1, 1, 2), e(1, -1, 2), a(kWidth, 0, 0);
  Triangles mesh{{{b, a, d}}, {{a, c, d}}, {{c, b, e}}, {{b, d, e}}, {{b, c, a}}, {{d, c, e}}};
  Random random(67);
  HardRays through{.name = "through the needle"}, within{.name = "from within", .closed = true};
  for (std::size_t i = 0; i < many(quick); ++i) {
    const float x = random.in(-1, 2) * kWidth, y = random.in(-1, 1) * kWidth;
    through.rays.push_back({{x, y, -3}, 0, {0, 0, 1}, kFar});
    within.rays.push_back(
        towards({random.in(-0.2f, 0.2f), random.in(-0.2f, 0.2f), 1}, random.flip() ? a : glm::vec3(x, y, 0)));
  }
  for (int i = 0; i < (quick ? 200 : 2000); ++i) {
    const glm::vec3 p = random.point(1) * power_of_two(static_cast<int>(random.below(45)) - 10) + glm::vec3(0, 0, -9);
    const glm::vec3 tip = random.point(1) * power_of_two(-20 - static_cast<int>(random.below(126)));
    mesh.push_back({{p, p * -power_of_two(static_cast<int>(random.below(9)) - 4), tip}});
  }
  HardRays at{.name = "at vertices, edges and inner points", .rays = at_targets(mesh, many(quick), {3, 2, 1}, 4, 68)};
  return {scene_of("hairs", std::move(mesh)), {std::move(through), std::move(within), std::move(at)}};
}

HardScene needles(bool quick) {
  Random random(62);
  Triangles mesh;
  for (int i = 0; i < (quick ? 400 : 4000); ++i) {
    const glm::vec3 a = random.point(1), b = random.point(1), c = b + random.point(i % 2 ? 1e-4f : 1e-6f);
    mesh.push_back({a, b, c});
  }
  std::vector<HardRays> sets{{.name = "at needles"}, {.name = "around"}};
  sets[0].rays = at_targets(mesh, many(quick), {0.1f, 0.2f, 0.3f}, 2, 63);
  sets[1].rays = around(bounds_of(mesh), many(quick), 64);
  // A closed sphere stretched to slivers: 1e5 times as long as thick.
  Triangles cigar = octasphere(quick ? 3 : 5);
  for (Triangle& t : cigar)
    for (glm::vec3& v : t) v = {v.x * 1e3f, 10 + v.y * 1e-2f, v.z * 1e-2f};
  HardRays inside{.name = "within a thin cigar", .closed = true};
  Random place(65);
  for (std::size_t i = 0; i < many(quick); ++i)
    inside.rays.push_back(
        towards({place.in(-500, 500), 10 + place.in(-2e-3f, 2e-3f), place.in(-2e-3f, 2e-3f)}, target(cigar, place)));
  sets.push_back(std::move(inside));
  append(mesh, cigar);
  return {scene_of("needles", std::move(mesh)), std::move(sets)};
}

// Edges of 11.2, 9.7 and 1.4. The rays arrive 0.52 degrees off the triangle's plane (tangent 0.0090762), at points well
// inside it.
HardScene thin_triangle(bool quick) {
  const Triangle t{{{-3.1f, 0.4f, 1.2f}, {8.1f, 0.4f, 1.2f}, {6.52f, 1.6f, 1.2f}}};
  HardRays set{.name = "0.52 degrees off the plane"};
  Random random(66);
  for (std::size_t i = 0; i < many(quick); ++i) {
    const float u = random.in(0.2f, 0.6f), v = random.in(0.2f, 0.35f);
    glm::vec3 along = random.direction() * 100.f;
    along.z = 0;
    const float length = std::sqrt(along.x * along.x + along.y * along.y);
    along.z = random.sign() * 0.0090762f * length;
    set.rays.push_back({point_of(t, u, v) - along, 0, along, kFar});
    set.answers.push_back(0);
  }
  return {scene_of("thin-triangle", {t}), {std::move(set)}};
}

HardScene grazing(bool quick) {
  Triangles mesh = plane_grid(16, 8, 0);
  append(mesh, moved(soup(500, 0.3f, 67), 4, {0, 12, 0}));
  std::vector<HardRays> sets{
      {.name = "in a flat plane"}, {.name = "an ulp off a flat plane"}, {.name = "in planes of triangles"}};
  Random random(68);
  for (std::size_t i = 0; i < many(quick); ++i) {
    const float x = static_cast<float>(random.below(65)) / 4 - 8, z = static_cast<float>(random.below(65)) / 4 - 8;
    const glm::vec3 along(static_cast<float>(random.below(9)) - 4, 0, static_cast<float>(random.below(9)) - 3.5f);
    sets[0].rays.push_back({{x, 0, z}, 0, along, kFar});
    const float height = beside(0, random), tilt = beside(height == 0 ? 0x1p-20f : 0, random);
    sets[1].rays.push_back({{-20, height, z}, 0, {1, tilt * random.sign(), 0.25f}, kFar});
    const Triangle& t = mesh[random.below(mesh.size())];
    const glm::vec3 edge = t[1] - t[0], middle = (t[0] + t[1] + t[2]) / 3.f;
    const float off = random.flip() ? 0 : random.in(-1e-5f, 1e-5f);
    const glm::vec3 dir = edge + glm::cross(edge, t[2] - t[0]) * off;
    sets[2].rays.push_back({middle - dir * 3.f, 0, dir, kFar});
  }
  sets[0].answers = all(sets[0].rays.size(), NO_HIT);
  return {scene_of("grazing", std::move(mesh)), std::move(sets)};
}

// Every triangle of the walls 40 times. The copies' numbers are far apart, so they lie in different leaves. The
// smallest number is the right answer.
HardScene duplicates(bool quick) {
  Triangles mesh;
  for (int copy = 0; copy < 40; ++copy) append(mesh, walls());
  std::vector<HardRays> sets{{.name = "copies of walls"}, {.name = "copies of a soup"}};
  Random random(69);
  for (std::size_t i = 0; i < many(quick); ++i) {
    std::uint32_t prim = 0;
    sets[0].rays.push_back(at_wall(random, prim));
    sets[0].answers.push_back(prim);
  }
  const Triangles cloud = moved(soup(300, 0.3f, 70), 4, {-30, -30, -30});
  for (int copy = 0; copy < 8; ++copy) {  // each time in another order
    Triangles shuffled = cloud;
    for (std::size_t i = shuffled.size(); i-- > 1;) std::swap(shuffled[i], shuffled[random.below(i + 1)]);
    append(mesh, shuffled);
  }
  sets[1].rays = at_targets(cloud, many(quick), {-30, -30, -30}, 8, 71);
  return {scene_of("duplicates", std::move(mesh)), std::move(sets), {.max_leaf = 2, .split_budget = 0}};
}

HardScene coplanar_overlaps(bool quick) {
  Triangles mesh = soup(400, 0.4f, 72);
  for (std::size_t i = 0; i < mesh.size(); ++i)
    for (glm::vec3& v : mesh[i]) v.z = i % 2 ? 0.5f : 0.25f + 0.125f * v.x;  // a flat plane and a tilted one
  std::vector<HardRays> sets{{.name = "at both planes"}, {.name = "along z"}};
  sets[0].rays = at_targets(mesh, many(quick), {0.1f, 0.1f, 3}, 1, 73);
  Random random(74);
  for (std::size_t i = 0; i < many(quick); ++i) {
    glm::vec3 from = target(mesh, random);
    from.z = random.flip() ? -2.f : 2.f;
    sets[1].rays.push_back({from, 0, {0, 0, from.z > 0 ? -1.f : 1.f}, kFar});
  }
  return {scene_of("coplanar-overlaps", std::move(mesh)), std::move(sets)};
}

HardScene interpenetrating(bool quick) {
  Triangles mesh = octasphere(quick ? 3 : 5);
  append(mesh, moved(icosphere(quick ? 3 : 5), 1, {0.5f, 0.25f, 0}));
  append(mesh, moved(cube_grid(8, 1), 0.75f, {0.25f, 0, 0.25f}));
  std::vector<HardRays> sets{{.name = "from where all overlap", .closed = true}, {.name = "around"}};
  sets[0].rays = at_targets(mesh, many(quick), {0.25f, 0.1f, 0.1f}, 0.3f, 75);
  sets[1].rays = around(bounds_of(mesh), many(quick), 76);
  return {scene_of("interpenetrating", std::move(mesh)), std::move(sets)};
}

}  // namespace ballot::hard
