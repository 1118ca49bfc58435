// Hard cases of closest points and of the inside test.
#include <cmath>
#include <glm/geometric.hpp>

#include "tools/hard/generate.h"

namespace ballot {
namespace hard {
namespace {

/// Returns the points that make() gives, without a limit.
template <class Make>
HardPoints points_of(std::string name, std::size_t count, const Make& make) {
  HardPoints set{.name = std::move(name)};
  set.points.reserve(count);
  while (set.points.size() < count) set.points.push_back({make(), kInf});
  return set;
}

/// Returns a random point of a lattice with this step, of `size` steps along each axis.
glm::vec3 lattice_point(Random& random, std::size_t size, float step) {
  const auto next = [&] { return step * static_cast<float>(random.below(size + 1)); };
  const float x = next(), y = next(), z = next();
  return {x, y, z};
}

/// Returns points of a lattice, and the same number of them an ulp beside.
std::vector<HardPoints> lattice_sets(bool quick, std::size_t size, float step, const glm::vec3& from,
                                     std::uint64_t seed) {
  Random random(seed);
  const auto at = [&] { return from + lattice_point(random, size, step); };
  std::vector<HardPoints> sets{points_of("lattice", many(quick), at)};
  sets.push_back(points_of("an ulp beside", many(quick), [&] { return beside(at(), random); }));
  return sets;
}

}  // namespace

// Two boxes that stand on one plane. Half of the lattice's points lie in planes of faces.
HardPointScene coplanar_points(bool quick) {
  Triangles mesh = moved(cube_grid(2, 1), 1, {1, 1, 1});
  append(mesh, moved(cube_grid(1, 1), 1, {5, 1, 1}));
  std::vector<HardPoints> sets = lattice_sets(quick, 16, 0.5f, {-1, -1, -1}, 80);
  return {scene_of("coplanar-points", std::move(mesh)), std::move(sets)};
}

// Corners of up to nearly 180 degrees. Points lie in planes of triangles and above them.
HardPointScene obtuse_triangles(bool quick) {
  Random random(81);
  Triangles mesh;
  for (int i = 0; i < 300; ++i) {
    const glm::vec3 a = random.point(4), b = a + random.direction(), along = b - a;
    const glm::vec3 across = glm::cross(along, random.direction()) * power_of_two(-1 - i % 20);
    mesh.push_back({a, b, a + along * random.in(0, 1) + across});
  }
  const auto in_plane = [&] {
    const Triangle& t = mesh[random.below(mesh.size())];
    const float u = random.in(-1, 2), v = random.in(-1, 2);
    return point_of(t, u, v);
  };
  std::vector<HardPoints> sets{points_of("in planes of triangles", many(quick), in_plane)};
  sets.push_back(points_of("above", many(quick), [&] { return in_plane() + random.point(0.1f); }));
  return {scene_of("obtuse-triangles", std::move(mesh)), std::move(sets)};
}

// Closed blades whose edges have angles of 1 to 1e-6. Points lie on and beside edges, and on the continuation of the
// blade, where its two sides are as near.
HardPointScene acute_edges(bool quick) {
  Triangles mesh;
  for (int i = 0; i < 6; ++i) {
    const float thin = power_of_two(-4 * i);
    for (Triangle t : octasphere(0)) {
      for (glm::vec3& v : t) v = glm::vec3(v.x, v.y * thin, v.z) + glm::vec3(0, 4.f * static_cast<float>(i), 0);
      mesh.push_back(t);
    }
  }
  Random random(82);
  const auto at_edge = [&] {
    const Triangle& t = mesh[random.below(mesh.size())];
    const std::size_t k = random.below(3);
    return t[k] + (t[(k + 1) % 3] - t[k]) * (static_cast<float>(random.below(17)) / 16);
  };
  std::vector<HardPoints> sets{
      points_of("beside edges", many(quick), [&] { return beside(at_edge(), random); }),
      points_of("about edges", many(quick),
                [&] { return at_edge() + random.point(power_of_two(-int(random.below(20)))); }),
      points_of("beyond edges", many(quick), [&] {
        glm::vec3 p = at_edge();
        p.x *= 1.5f, p.z *= 1.5f;
        return p;
      })};
  return {scene_of("acute-edges", std::move(mesh)), std::move(sets)};
}

// A sphere that is symmetric in every axis, its centre and planes of symmetry; a cube, its centre and diagonals; two
// plates, and points halfway between.
HardPointScene middles(bool quick) {
  const glm::vec3 cube(8, 0, 0), plates(0, 8, 0);
  Triangles mesh = octasphere(quick ? 2 : 4);
  append(mesh, moved(cube_grid(4, 1), 1, cube));
  append(mesh, moved(plane_grid(8, 2, 1), 1, plates));
  append(mesh, moved(plane_grid(8, 2, -1), 1, plates));
  Random random(83);
  const auto of_cube = [&] {
    const float x = random.in(-1, 1);
    return cube + glm::vec3(x, random.sign() * x, random.flip() ? random.sign() * x : random.in(-1, 1));
  };
  const auto of_plates = [&] {
    const float x = random.in(-2, 2), z = random.in(-2, 2);
    return plates + glm::vec3(x, 0, z);
  };
  const auto of_sphere = [&] {
    glm::vec3 p = random.point(0.25f);
    for (int k = 0; k < 3; ++k)
      if (random.flip()) p[k] = random.flip() ? 0 : p[(k + 1) % 3];
    return p;
  };
  std::vector<HardPoints> sets{
      points_of("of a sphere", many(quick), of_sphere), points_of("of a cube", many(quick), of_cube),
      points_of("of plates", many(quick), of_plates),
      points_of("an ulp off", many(quick), [&] { return beside(random.flip() ? of_cube() : of_plates(), random); })};
  return {scene_of("middles", std::move(mesh)), std::move(sets)};
}

// A closed top of two fans about an axis: all triangles of a fan meet in its tip.
HardPointScene shared_corner(bool quick) {
  const int quarter = quick ? 75 : 750, sides = 4 * quarter;
  const glm::vec3 tips[] = {{0, 1, 0}, {0, -0.5f, 0}};
  const auto rim = [&](int i) {
    const float s = static_cast<float>(i % quarter) / static_cast<float>(quarter), scale = 1 / (1 + s * s);
    const float x = (1 - s * s) * scale, z = 2 * s * scale;
    const glm::vec3 turned[] = {{x, 0, z}, {-z, 0, x}, {-x, 0, -z}, {z, 0, -x}};
    return turned[i / quarter % 4];
  };
  Triangles mesh;
  for (int i = 0; i < sides; ++i) {
    mesh.push_back({tips[0], rim(i + 1), rim(i)});
    mesh.push_back({tips[1], rim(i), rim(i + 1)});
  }
  Random random(84);
  std::vector<HardPoints> sets{
      points_of("beside tips", many(quick), [&] { return beside(tips[random.below(2)], random); }),
      points_of("beyond tips", many(quick) / 4,
                [&] { return tips[random.below(2)] * random.in(1, 8) + random.point(0.2f); }),
      points_of("on the axis", many(quick) / 4, [&] { return glm::vec3(0, random.in(-1, 2), 0); })};
  return {scene_of("shared-corner", std::move(mesh)), std::move(sets)};
}

// Spheres around each other, whose radii differ by 2^-22 of them and more.
HardPointScene near_shells(bool quick) {
  const Triangles ball = octasphere(quick ? 3 : 5);
  Triangles mesh;
  for (const int exponent : {-4, -8, -12, -16, -19, -22})
    append(mesh, moved(ball, 1 + power_of_two(exponent), {0, 0, 0}));
  append(mesh, ball);
  Random random(85);
  std::vector<HardPoints> sets{points_of(
      "between", many(quick), [&] { return target(ball, random) * (1 + power_of_two(-3 - int(random.below(21)))); })};
  sets.push_back(points_of("beside", many(quick), [&] { return beside(target(mesh, random), random); }));
  return {scene_of("near-shells", std::move(mesh)), std::move(sets)};
}

HardPointScene shell_lattice(bool quick) {
  return {touching_shells(quick).scene, lattice_sets(quick, 32, 0.25f, {-1, -1, -1}, 86)};
}

HardPointScene far_shell_lattice(bool quick) {
  const glm::vec3 centre(1e7f, -1e7f, 1e7f);  // that of far_shells()
  return {far_shells(quick).scene, lattice_sets(quick, 140, 1, centre - glm::vec3(70), 87)};
}

// Triangles without area, which are left out, lie nearer than the proper ones. The first are those of the report.
HardPointScene points_at_collinear(bool quick) {
  const glm::vec3 a(2.27699995f, -7.9000001f, 16.3180008f), b(-0.569999993f, -8.10000038f, 16.6070004f);
  const glm::vec3 reported(1.10000002f, -7.9000001f, 16.5879993f);
  Triangles mesh{{a, b, b}, {a, b, a + glm::vec3(0, 0, 1)}};
  Random random(88);
  for (int i = 0; i < 200; ++i) {
    const glm::vec3 p = 16.f * lattice_point(random, 8, 0.125f), step(1, 2, static_cast<float>(random.below(3)));
    mesh.push_back({p, p + step, p + 2.f * step});
    mesh.push_back({p, p + step, p + step});
    mesh.push_back({p, p + step, p + glm::vec3(step.z, 0, 1)});
  }
  std::vector<HardPoints> sets{
      points_of("report", 3, [&] { return beside(reported, random); }),
      points_of("at triangles", many(quick), [&] { return beside(target(mesh, random), random); }),
      points_of("around", many(quick), [&] { return random.point(20); })};
  return {scene_of("points-at-collinear", std::move(mesh)), std::move(sets)};
}

HardPointScene far_points(bool quick) {
  Triangles mesh = octasphere(2);
  append(mesh, moved(soup(20, 0.5f, 89), 1, {4, 0, 0}));
  Random random(89);
  HardPoints far{.name = "far"}, dead{.name = "dead"};
  for (const float distance : {30.f, 40.f, 1e3f, 1e6f, 1e9f, 1e12f, 1e18f, 1e20f, 1e30f, 3e38f})
    for (int i = 0; i < (quick ? 10 : 100); ++i) {
      far.points.push_back({distance * random.direction(), kInf});
      glm::vec3 along(0);
      along[int(random.below(3))] = distance * random.sign();
      far.points.push_back({along, random.flip() ? kInf : kFar});
    }
  for (const float bad : {kNan, kInf, -kInf})
    for (int k = 0; k < 3; ++k) {
      ProbePoint p{{0.1f, 0.2f, 0.3f}, kInf};
      p.at[k] = bad;
      dead.points.push_back(p);
      dead.points.push_back({{0.1f, 0.2f, 0.3f}, kInf});  // a live neighbour
    }
  for (const float limit : {kNan, -1.f, -0.f}) dead.points.push_back({{0.1f, 0.2f, 0.3f}, limit});
  return {scene_of("far-points", std::move(mesh)), {std::move(far), std::move(dead)}};
}

// Points of a lattice about a cube that are a whole number away from its faces, edges or corners along one axis.
HardPointScene limits_at_distances(bool quick) {
  const Triangles mesh = moved(cube_grid(4, 4), 1, {4, 4, 4});
  Random random(90);
  HardPoints set{.name = "limits"};
  while (set.points.size() < many(quick)) {
    glm::vec3 p = lattice_point(random, 8, 1);
    const int axis = int(random.below(3)), out = int(random.below(16));
    p[axis] = random.flip() ? 8 + static_cast<float>(out) : -static_cast<float>(out);
    set.points.push_back({p, beside(static_cast<float>(out), random)});
  }
  return {scene_of("limits-at-distances", mesh), {std::move(set)}};
}

}  // namespace hard

std::vector<HardPoints> hard_points_of(std::span<const Triangle> triangles, bool quick) {
  if (triangles.empty()) return {};
  const hard::Triangles mesh(triangles.begin(), triangles.end());
  const Bounds bounds = hard::bounds_of(mesh);
  const glm::vec3 middle = 0.5f * bounds.lo + 0.5f * bounds.hi, half = 0.5f * bounds.hi - 0.5f * bounds.lo;
  const std::size_t count = hard::many(quick) / 2;
  hard::Random random(91);
  std::vector<HardPoints> sets{
      hard::points_of("on triangles", count, [&] { return hard::target(mesh, random); }),
      hard::points_of("an ulp beside", count, [&] { return hard::beside(hard::target(mesh, random), random); }),
      hard::points_of("around", count, [&] { return middle + half * random.point(1.5f); })};
  return sets;
}

}  // namespace ballot
