// Hard cases of scale and position: tiny, huge, both at once, far from the origin, seen from far away.
#include <cmath>

#include "tools/hard/generate.h"

namespace ballot::hard {
namespace {

/// Returns rays from points of a box above the mesh at targets on its first `targets` triangles.
std::vector<Ray> from_above(const Triangles& mesh, std::size_t count, std::size_t targets, const Bounds& box,
                            std::uint64_t seed) {
  Random random(seed);
  const Triangles ground(mesh.begin(), mesh.begin() + static_cast<std::ptrdiff_t>(targets));
  std::vector<Ray> rays;
  while (rays.size() < count) {
    glm::vec3 from;
    for (int k = 0; k < 3; ++k) from[k] = random.in(box.lo[k], box.hi[k]);
    rays.push_back(towards(from, target(ground, random)));
  }
  return rays;
}

}  // namespace

Triangles city(int n, float cell, const glm::vec3& corner, std::size_t buildings) {
  const auto at = [&](int i, int j) {
    const glm::vec3 p(static_cast<float>(i) * cell, 0, static_cast<float>(j) * cell);
    const float height = 60 + 50 * noise(p / 400.f, 4) + 8 * noise(p / 60.f, 5);
    return corner + glm::vec3(p.x, std::floor(height * 8 + 0.5f) / 8, p.z);
  };
  Triangles mesh;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      mesh.push_back({at(i, j), at(i, j + 1), at(i + 1, j + 1)});
      mesh.push_back({at(i, j), at(i + 1, j + 1), at(i + 1, j)});
    }
  Random random(40);
  for (std::size_t b = 0; b < buildings; ++b) {
    const float half = static_cast<float>(4 + random.below(5));
    const auto place = [&] { return std::floor(random.in(0.1f, 0.9f) * static_cast<float>(n) * cell); };
    const float x = place(), z = place();
    append(mesh, moved(cube_grid(1, half), 1, corner + glm::vec3(x, 90 + half, z)));
  }
  return mesh;
}

// One sphere for each exponent, among them those at which products of two and of three lengths leave float32's range.
// The spheres are far from each other relative to their own size. Directions are as long as the sphere, or of unit
// length.
HardScene tiny_spheres(bool quick) {
  const int exponents[] = {-20, -40, -50, -60, -70, -80, -90, -100};
  Triangles mesh;
  std::vector<HardRays> sets;
  for (const int e : exponents) {
    const float size = power_of_two(e);
    const glm::vec3 centre(size * 64, 0, 0);
    const Triangles sphere = moved(octasphere(quick ? 2 : 4), size, centre);
    HardRays set{.name = "radius 2^" + std::to_string(e), .closed = true};
    set.rays = at_targets(sphere, many(quick) / 5, centre, size / 2, 41);
    for (std::size_t i = 0; i < set.rays.size(); i += 2) set.rays[i].dir *= power_of_two(-e);
    sets.push_back(std::move(set));
    append(mesh, sphere);
  }
  return {scene_of("tiny-spheres", std::move(mesh)), std::move(sets)};
}

HardScene tiny_in_huge(bool quick) {
  Triangles mesh;
  std::vector<HardRays> sets;
  for (const float size : {1e-12f, 1e-6f, 1e-3f, 1.f, 1e3f, 1e6f}) {
    append(mesh, moved(octasphere(quick ? 2 : 4), size, {0, 0, 0}));
    HardRays set{.name = fmt::format("from within radius {}", size), .closed = true};
    set.rays = at_targets(moved(octasphere(2), size, {0, 0, 0}), many(quick) / 5, {0, 0, 0}, size / 2, 42);
    for (std::size_t i = 0; i < set.rays.size(); i += 2) set.rays[i].dir *= 1 / size;
    sets.push_back(std::move(set));
  }
  return {scene_of("tiny-in-huge", std::move(mesh)), std::move(sets)};
}

HardScene huge_sphere(bool quick) {
  const Triangles mesh = moved(octasphere(quick ? 3 : 5), 9e11f, {0, 0, 0});
  std::vector<HardRays> sets{{.name = "from within", .closed = true}, {.name = "short directions", .closed = true}};
  sets[0].rays = at_targets(mesh, many(quick), {1e9f, 2e9f, -1e9f}, 4e11f, 43);
  sets[1].rays = at_targets(mesh, many(quick), {1e9f, 2e9f, -1e9f}, 4e11f, 44);
  for (Ray& r : sets[1].rays) r.dir *= 1e-12f;
  return {scene_of("huge-sphere", mesh), std::move(sets)};
}

HardScene huge_planes(bool quick) {
  Triangles mesh;
  std::vector<HardRays> sets{{.name = "down from near the centre", .closed = true},
                             {.name = "down at the diagonal", .closed = true},
                             {.name = "oblique"}};
  int down = 0;
  for (const float half : {5.9e8f, 5.9e9f, 5.9e10f, 5.9e11f})  // the largest is the lowest, so that rays reach all
    append(mesh, plane_grid(1, half, -10.f * static_cast<float>(++down)));
  Random random(45);
  for (std::size_t i = 0; i < many(quick); ++i) {
    const float width = random.flip() ? 10.f : 1e11f, x = random.in(-width, width), y = random.in(0.1f, 5);
    sets[0].rays.push_back({{x, y, random.in(-width, width)}, 0, {0, -1, 0}, kFar});
    sets[1].rays.push_back({{x, y, x}, 0, {0, -1, 0}, kFar});
    sets[2].rays.push_back({{x, y, random.in(-width, width)}, 0, random.direction(), kFar});
  }
  return {scene_of("huge-planes", std::move(mesh)), std::move(sets)};
}

HardScene far_offsets(bool quick) {
  Triangles mesh;
  std::vector<HardRays> sets;
  for (const float offset : {1e5f, 4.5e6f, 6e6f}) {
    const glm::vec3 centre(offset, -offset, 0.37f * offset);
    const Triangles sphere = moved(octasphere(quick ? 3 : 4), 500, centre);
    HardRays set{.name = fmt::format("sphere at {}", offset), .closed = true};
    set.rays = at_targets(sphere, many(quick) / 2, centre, 200, 46);
    sets.push_back(std::move(set));
    append(mesh, sphere);
  }
  return {scene_of("far-offsets", std::move(mesh)), std::move(sets)};
}

HardScene utm_terrain(bool quick) {
  const glm::vec3 corner(458000, 0, 5428000);  // easting, height, northing, metres
  const int n = quick ? 48 : 160;
  const float cell = 16, width = cell * static_cast<float>(n);
  Triangles mesh = city(n, cell, corner, quick ? 60 : 800);
  const auto ground = static_cast<std::size_t>(2 * n * n);
  std::vector<HardRays> sets{{.name = "straight down at edges and vertices", .closed = true},
                             {.name = "from a plane's height"},
                             {.name = "from the street"}};
  Random random(47);
  while (sets[0].rays.size() < many(quick)) {
    glm::vec3 p = target(mesh, random);
    if (p.x <= corner.x || p.x >= corner.x + width || p.z <= corner.z || p.z >= corner.z + width) continue;
    p.y = 400 + static_cast<float>(random.below(1000));
    sets[0].rays.push_back({p, 0, {0, -1, 0}, kFar});
  }
  const auto over = [&](float low, float high) {
    return Bounds{corner + glm::vec3(0, low, 0), corner + glm::vec3(width, high, width)};
  };
  sets[1].rays = from_above(mesh, many(quick), mesh.size(), over(500, 3000), 48);
  sets[2].rays = from_above(mesh, many(quick), ground, over(80, 100), 49);
  return {scene_of("utm-terrain", std::move(mesh)), std::move(sets)};
}

// A view like a telescope's, 1e6 radii away and narrow; also from 1e4 radii, and from both sides of distance 64.
HardScene narrow_view(bool quick) {
  const Triangles mesh = octasphere(quick ? 4 : 6);
  std::vector<HardRays> sets;
  for (const float distance : {63.f, 65.f, 1e4f, 1e6f}) {  // shear_scale() changes at 64
    Random random(50);
    HardRays inside{.name = fmt::format("from {} at the inner half", distance), .closed = true};
    HardRays outline{.name = fmt::format("from {} at the outline", distance)};
    const glm::vec3 eye = distance * glm::vec3(0.8f, 0, 0.6f), across(0.6f, 0, -0.8f), up(0, 1, 0);
    for (std::size_t i = 0; i < many(quick); ++i) {
      const float a = random.in(-1, 1), b = random.in(-1, 1);
      inside.rays.push_back(towards(eye, (across * a + up * b) * 0.5f));
      outline.rays.push_back(towards(eye, across * (a * 1.1f) + up * (b * 1.1f)));
    }
    sets.push_back(std::move(inside));
    sets.push_back(std::move(outline));
  }
  return {scene_of("narrow-view", mesh), std::move(sets)};
}

}  // namespace ballot::hard
