// Hard cases of closed meshes, and of a plane under one. Most rays start inside, and most aim at edges and vertices.
// Every ray of a set with `closed` must hit.
#include <cmath>
#include <limits>

#include "tools/hard/generate.h"

namespace ballot::hard {
namespace {

/// Returns a closed, star-shaped mesh about the origin with integer vertices. Its radius is `size` times 0.6 to 1.4.
Triangles statue(int levels, float size) {
  Triangles mesh = octasphere(levels);
  for (Triangle& t : mesh)
    for (glm::vec3& v : t) {
      const float bumps = 0.25f * noise(v * 3.f, 1) + 0.1f * noise(v * 9.f, 2);
      const glm::vec3 p = v * (size * (1 + bumps));
      v = {std::floor(p.x + 0.5f), std::floor(p.y + 0.5f), std::floor(p.z + 0.5f)};
    }
  return mesh;
}

/// Returns rays from a regular grid of integer points, like the pixels of one picture: down, and at height 0 also up.
std::vector<Ray> grid_of_rays(std::size_t count, float half, float height) {
  const auto side = static_cast<int>(std::sqrt(static_cast<double>(count)));
  const float step = std::floor(2 * half / static_cast<float>(side)) + 1;
  std::vector<Ray> rays;
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i) {
      const float x = step * static_cast<float>(i - side / 2), z = step * static_cast<float>(j - side / 2);
      if (std::abs(x) > half || std::abs(z) > half) continue;
      rays.push_back({{x, height, z}, 0, {0.f, -1.f, 0.f}, kFar});
      if (height == 0) rays.push_back({{x, 0, z}, 0, {-0.f, 1.f, -0.f}, kFar});
    }
  return rays;
}

}  // namespace

HardScene closed_icosphere(bool quick) {
  const Triangles mesh = icosphere(quick ? 3 : 5);
  std::vector<HardRays> sets{{.name = "edges and vertices", .closed = true},
                             {.name = "along the axes", .closed = true},
                             {.name = "any hit", .want = Want::Any, .closed = true}};
  sets[0].rays = at_targets(mesh, many(quick), {0, 0, 0}, 0.5f, 20);
  sets[1].rays = axes_from_within(mesh, many(quick), {0, 0, 0}, 1, 21);
  sets[2].rays = at_targets(mesh, many(quick), {0.01f, 0.02f, -0.015f}, 0.1f, 22);
  return {scene_of("icosphere", mesh), std::move(sets)};
}

HardScene closed_cube(bool quick) {
  const Triangles mesh = cube_grid(quick ? 16 : 64, 4);
  std::vector<HardRays> sets{{.name = "edges and vertices", .closed = true},
                             {.name = "along the axes", .closed = true},
                             {.name = "lattice directions", .closed = true}};
  sets[0].rays = at_targets(mesh, many(quick), {0.1f, -0.3f, 0.2f}, 3, 23);
  sets[1].rays = axes_from_within(mesh, many(quick), {0, 0, 0}, 4, 24);
  Random random(25);
  while (sets[2].rays.size() < many(quick)) {  // from lattice points: they hit many vertices and edges without rounding
    glm::vec3 from, dir;
    for (int k = 0; k < 3; ++k) from[k] = static_cast<float>(random.below(7)) - 3;
    for (int k = 0; k < 3; ++k) dir[k] = static_cast<float>(random.below(7)) - 3;
    if (dir != glm::vec3(0)) sets[2].rays.push_back({from, 0, dir, kFar});
  }
  return {scene_of("cube-grid", mesh), std::move(sets)};
}

HardScene far_sphere_and_plane(bool quick) {
  const glm::vec3 centre(148376, 1234, -223423);
  Triangles mesh = moved(octasphere(quick ? 3 : 5), 100, centre);
  std::vector<HardRays> sets{{.name = "sphere from within", .closed = true},
                             {.name = "plane from above", .closed = true}};
  sets[0].rays = at_targets(mesh, many(quick), centre, 30, 26);
  const Triangles plane = moved(plane_grid(quick ? 16 : 64, 128, -128), 1, centre);
  // From between the plane and the sphere. Half of the rays go straight down, half towards a point inside the plane's
  // border. Half of these points are vertices of the grid.
  Random random(27);
  for (std::size_t i = 0; i < many(quick); ++i) {
    glm::vec3 to = (target(plane, random) - centre) * glm::vec3(0.875f, 1, 0.875f);
    if (random.flip()) to = {std::floor(to.x / 16 + 0.5f) * 16, to.y, std::floor(to.z / 16 + 0.5f) * 16};
    to += centre;
    const glm::vec3 from = to + glm::vec3(random.in(-4, 4), 24, random.in(-4, 4));
    sets[1].rays.push_back(random.flip() ? towards(from, to) : Ray{from, 0, {0, -1, 0}, kFar});
  }
  append(mesh, plane);
  return {scene_of("far-sphere-and-plane", std::move(mesh)), std::move(sets)};
}

HardScene quantised_statue(bool quick) {
  const float size = quick ? 256 : 1024;
  const Triangles mesh = statue(quick ? 4 : 6, size);
  std::vector<HardRays> sets{{.name = "grid along y from within", .closed = true},
                             {.name = "edges and vertices", .closed = true},
                             {.name = "grid along -y from above"}};
  sets[0].rays = grid_of_rays(many(quick), size * 0.35f, 0);
  sets[1].rays = at_targets(mesh, many(quick), {0, 0, 0}, size * 0.3f, 28);
  sets[2].rays = grid_of_rays(many(quick), size * 1.4f, size * 2);
  return {scene_of("quantised-statue", mesh), std::move(sets)};
}

// The statue is so small that many triangles collapse to a line when vertices are rounded to integers. These triangles
// are left out of the tree. Where such a triangle lay, a long edge of one neighbour now runs along shorter edges of two
// others (a T-junction). Only rays along an axis, for which the shear of the watertight test is zero, are sure to hit
// there.
HardScene collapsed_statue(bool quick) {
  const float size = quick ? 6 : 12;
  const Triangles mesh = statue(quick ? 4 : 5, size);
  std::vector<HardRays> sets{{.name = "along y from within", .closed = true}, {.name = "edges and vertices"}};
  Random random(29);
  while (sets[0].rays.size() < many(quick)) {
    const auto half_integer = [&] {
      return static_cast<float>(static_cast<int>(random.below(static_cast<std::size_t>(size))) - int(size) / 2) * 0.5f;
    };
    const glm::vec3 from(half_integer(), half_integer(), half_integer());
    sets[0].rays.push_back({from, 0, {0, random.sign(), 0}, kFar});
  }
  sets[1].rays = at_targets(mesh, many(quick), {0, 0, 0}, size * 0.3f, 30);
  return {scene_of("collapsed-statue", mesh), std::move(sets)};
}

HardScene two_shells(bool quick) {
  const Triangles inner = octasphere(quick ? 3 : 5);
  Triangles mesh = moved(inner, 1 + 4e-5f, {0, 0, 0});
  append(mesh, inner);
  std::vector<HardRays> sets{{.name = "from the centre", .closed = true}, {.name = "from outside"}};
  sets[0].rays = at_targets(inner, many(quick), {0, 0, 0}, 0.3f, 31);
  sets[1].rays = around(bounds_of(mesh), many(quick), 32);
  return {scene_of("two-shells", std::move(mesh)), std::move(sets)};
}

HardScene rough_spheres(bool quick) {
  Triangles mesh = octasphere(quick ? 4 : 6);
  for (Triangle& t : mesh)
    for (glm::vec3& v : t) v = v * (1 + 0.4f * noise(v * 64.f, 3));
  std::vector<HardRays> sets{{.name = "exactly at vertices", .closed = true},
                             {.name = "beside vertices", .closed = true}};
  Random random(33);
  for (std::size_t i = 0; i < many(quick); ++i) {
    const glm::vec3 from = random.point(0.2f), v = mesh[random.below(mesh.size())][random.below(3)];
    sets[0].rays.push_back(towards(from, v));
    Ray beside = towards(from, v);
    for (int k = 0; k < 3; ++k)
      beside.dir[k] = std::nextafter(beside.dir[k], random.sign() * std::numeric_limits<float>::max());
    sets[1].rays.push_back(beside);
  }
  return {scene_of("rough-spheres", std::move(mesh)), std::move(sets)};
}

}  // namespace ballot::hard
