// Hard cases of directions: along the axes, with zeros of both signs, with denormal components, of every length; and
// origins on faces of boxes.
#include <cmath>

#include "tools/hard/generate.h"

namespace ballot::hard {
namespace {

constexpr float kDenormal = 1e-40f, kSmallestDenormal = 1e-45f, kSmallestNormal = 0x1p-126f;

float signed_zero(Random& random) { return random.flip() ? 0.f : -0.f; }

/// Returns rays along a random axis through a vertex or the middle of a triangle, which start there or 3 units before.
std::vector<Ray> along_axes(const Triangles& triangles, std::size_t count) {
  Random random(11);
  std::vector<Ray> rays;
  while (rays.size() < count) {
    const Triangle& t = triangles[random.below(triangles.size())];
    const glm::vec3 through = random.flip() ? t[random.below(3)] : (t[0] + t[1] + t[2]) / 3.f;
    const std::size_t axis = random.below(3);
    glm::vec3 dir;
    for (int k = 0; k < 3; ++k) dir[k] = signed_zero(random);
    dir[static_cast<int>(axis)] = random.sign();
    rays.push_back({random.below(3) == 0 ? through : through - dir * 3.f, 0, dir, kFar});
  }
  return rays;
}

/// Returns rays from points on faces of the tree's boxes. In half of them the component along the face's axis is zero.
std::vector<Ray> from_faces(const Triangles& triangles, std::size_t count) {
  Random random(12);
  const Bvh bvh = build_bvh(triangles);
  std::vector<Ray> rays;
  while (rays.size() < count) {
    const std::size_t index = random.below(bvh.nodes.size());
    if (index == 1) continue;  // slot 1 holds no node
    const BvhNode& n = bvh.nodes[index];
    glm::vec3 from, dir = random.direction();
    for (int k = 0; k < 3; ++k) from[k] = random.in(n.lo[k], n.hi[k]);
    const int axis = static_cast<int>(random.below(3));
    from[axis] = random.flip() ? n.lo[axis] : n.hi[axis];
    if (random.flip()) dir[axis] = signed_zero(random);
    if (random.below(4) == 0) dir[(axis + 1) % 3] = signed_zero(random);
    rays.push_back({from, 0, dir, kFar});
  }
  return rays;
}

/// Returns a direction whose largest component is 1 or -1, along a random axis.
glm::vec3 unit_of_largest(Random& random) {
  glm::vec3 dir = random.point(0.999f);
  const int axis = static_cast<int>(random.below(3));
  dir[axis] = random.sign();
  return dir;
}

/// Returns rays from inside the mesh in directions whose largest component is between 2^low and 2^(high + 1).
std::vector<Ray> of_lengths(std::size_t count, float spread, int low, int high, float t_max) {
  Random random(13);
  std::vector<Ray> rays;
  while (rays.size() < count) {
    const int exponent = low + static_cast<int>(random.below(static_cast<std::size_t>(high - low + 1)));
    const glm::vec3 from = random.point(spread), dir = unit_of_largest(random) * power_of_two(exponent);
    rays.push_back({from, 0, dir, t_max});
  }
  return rays;
}

}  // namespace

HardScene axis_directions(bool quick) {
  Triangles mesh = cube_grid(8, 4);
  const Triangles inner = soup(2000, 0.1f, 10);
  std::vector<HardRays> sets{{.name = "from within the cube", .closed = true}, {.name = "through vertices"}};
  sets[0].rays = axes_from_within(mesh, many(quick), {0, 0, 0}, 4, 14);
  append(mesh, inner);
  sets[1].rays = along_axes(mesh, many(quick));
  return {scene_of("axes", std::move(mesh)), std::move(sets)};
}

// Squares over [0, 4]^2, one below the other: every box of the tree begins at x = 0 and at z = 0, where the rays of the
// first set start. Rays at other places of such faces have no known answers; the oracle decides them.
HardScene box_faces(bool quick) {
  Triangles mesh;
  for (int i = 0; i < 32; ++i) append(mesh, moved(plane_grid(1, 2, 0), 1, glm::vec3(2, -static_cast<float>(i), 2)));
  HardRays on_edges{.name = "down the face at 0"};
  Random random(15);
  for (std::size_t i = 0; i < many(quick); ++i) {
    const float along = static_cast<float>(1 + random.below(511)) / 128, z = signed_zero(random);
    const bool at_x = random.flip();
    const glm::vec3 from(at_x ? 0 : along, 1 + static_cast<float>(random.below(8)), at_x ? along : 0);
    on_edges.rays.push_back(
        {from, 0, {z, -power_of_two(static_cast<int>(random.below(5))), signed_zero(random)}, kFar});
    on_edges.answers.push_back(at_x ? 0 : 1);
  }
  std::vector<HardRays> sets{std::move(on_edges), {.name = "faces of the tree's boxes"}};
  append(mesh, moved(soup(1000, 0.2f, 16), 4, {-40, 0, 0}));
  sets[1].rays = from_faces(mesh, many(quick));
  return {scene_of("box-faces", std::move(mesh)), std::move(sets)};
}

HardScene denormal_directions(bool quick) {
  Random random(17);
  const float small[] = {kDenormal, kSmallestDenormal, kSmallestNormal, 1e-30f, 0};
  HardRays set{.name = "denormal components", .closed = true};
  for (std::size_t i = 0; i < many(quick); ++i) {
    glm::vec3 from = random.point(0.5f), dir;
    for (int k = 0; k < 3; ++k) dir[k] = random.sign() * small[random.below(5)];
    const int axis = static_cast<int>(random.below(3));
    dir[axis] = random.sign();
    if (random.below(4) == 0) dir[(axis + 1) % 3] = random.in(-1, 1);
    if (random.flip()) from[(axis + 2) % 3] = random.sign() * 0.f;  // where the octants of the sphere meet
    set.rays.push_back({from, 0, dir, kFar});
  }
  return {scene_of("denormal-directions", octasphere(4)), {std::move(set)}};
}

HardScene direction_lengths(bool quick) {
  HardRays set{.name = "2^-66 to 2^66", .closed = true};
  set.rays = of_lengths(many(quick), 0.5f, -66, 66, kFar);
  return {scene_of("direction-lengths", octasphere(4)), {std::move(set)}};
}

HardScene short_directions(bool quick) {
  HardRays set{.name = "2^-126 to 2^-100", .closed = true};
  set.rays = of_lengths(many(quick), 0.125f, -126, -100, 3e38f);
  return {scene_of("short-directions", moved(octasphere(4), 0.25f, {0, 0, 0})), {std::move(set)}};
}

HardScene long_directions(bool quick) {
  HardRays set{.name = "2^100 to 2^127", .closed = true};
  set.rays = of_lengths(many(quick), 0x1p18f, 100, 126, kFar);
  return {scene_of("long-directions", moved(octasphere(4), 0x1p20f, {0, 0, 0})), {std::move(set)}};
}

}  // namespace ballot::hard
