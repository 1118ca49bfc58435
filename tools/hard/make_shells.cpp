// Hard cases of all crossings along a ray: closed surfaces that touch or enclose each other, and rays through their
// edges and vertices and in the planes of their faces.
#include "tools/hard/generate.h"

namespace ballot::hard {
namespace {

/// Returns the closed box [lo, hi], of 2 x 2 squares a face.
Triangles box(const glm::vec3& lo, const glm::vec3& hi) {
  Triangles mesh = cube_grid(2, 1);
  for (Triangle& t : mesh)
    for (glm::vec3& v : t) v = 0.5f * (lo + hi) + 0.5f * (hi - lo) * v;
  return mesh;
}

/// Returns rays between points of a lattice, in all directions of small integers, of which many lie in planes of faces.
std::vector<Ray> lattice_rays(std::size_t count, int size, const glm::vec3& offset, std::uint64_t seed) {
  Random random(seed);
  std::vector<Ray> rays;
  while (rays.size() < count) {
    glm::vec3 at, dir;
    for (int k = 0; k < 3; ++k) at[k] = static_cast<float>(random.below(static_cast<std::size_t>(size) + 3)) - 1;
    for (int k = 0; k < 3; ++k) dir[k] = static_cast<float>(random.below(7)) - 3;
    if (dir == glm::vec3(0)) continue;
    const float back = random.flip() ? 0.f : 16.f;
    rays.push_back({offset + at - back * dir, 0, dir, kFar});
  }
  return rays;
}

/// Returns rays at vertices, edges and faces, from outside.
std::vector<Ray> from_outside(const Triangles& mesh, std::size_t count, float distance, std::uint64_t seed) {
  Random random(seed);
  std::vector<Ray> rays;
  while (rays.size() < count) {
    const glm::vec3 to = target(mesh, random);
    rays.push_back(towards(to + distance * random.direction(), to));
  }
  return rays;
}

}  // namespace

HardScene touching_shells(bool quick) {
  Triangles mesh = box({0, 0, 0}, {4, 4, 4});
  append(mesh, box({1, 1, 1}, {3, 3, 3}));  // inside of it
  append(mesh, box({4, 0, 0}, {6, 4, 4}));  // a face in common
  append(mesh, box({4, 4, 0}, {6, 6, 4}));  // a face with that one, an edge with the first
  append(mesh, box({4, 4, 4}, {6, 6, 6}));  // a vertex with the first
  append(mesh, box({0, 0, 0}, {2, 4, 2}));  // inside of the first, three faces within its faces
  std::vector<HardRays> sets{{.name = "lattice"}, {.name = "edges and vertices"}};
  sets[0].rays = lattice_rays(many(quick), 6, {0, 0, 0}, 70);
  sets[1].rays = from_outside(mesh, many(quick), 24, 71);
  return {scene_of("touching-shells", std::move(mesh)), std::move(sets)};
}

HardScene far_shells(bool quick) {
  const glm::vec3 centre(1e7f, -1e7f, 1e7f);
  Triangles mesh;
  for (const float radius : {32.f, 33.f, 64.f}) append(mesh, moved(octasphere(quick ? 2 : 4), radius, centre));
  append(mesh, moved(cube_grid(4, 64), 1, centre));
  std::vector<HardRays> sets{{.name = "lattice"}, {.name = "edges and vertices"}, {.name = "from within"}};
  sets[0].rays = lattice_rays(many(quick), 8, centre, 72);
  sets[1].rays = from_outside(mesh, many(quick), 300, 73);
  sets[2].rays = at_targets(mesh, many(quick), centre, 16, 74);
  return {scene_of("far-shells", std::move(mesh)), std::move(sets)};
}

HardScene sliver_shells(bool quick) {
  Triangles mesh;
  Random random(75);
  for (int i = 0; i < (quick ? 4 : 12); ++i) {
    glm::vec3 thin(1);
    thin[int(random.below(3))] = power_of_two(-4 - i);
    const Triangles ball = octasphere(quick ? 2 : 4);
    for (Triangle t : ball) {
      for (glm::vec3& v : t) v = v * thin;
      mesh.push_back(t);
    }
  }
  std::vector<HardRays> sets{{.name = "edges and vertices"}, {.name = "along the axes"}, {.name = "around"}};
  sets[0].rays = from_outside(mesh, many(quick), 4, 76);
  sets[1].rays = axes_from_within(mesh, many(quick), {0, 0, 0}, 1, 77);
  sets[2].rays = around(bounds_of(mesh), many(quick), 78);
  return {scene_of("sliver-shells", std::move(mesh)), std::move(sets)};
}

}  // namespace ballot::hard
