// Numeric mode double by the library: particles are not lost, hits are told apart where float32 cannot, and what is
// refused.
#include <limits>

#include "solids.h"

namespace double_mode {

namespace {

using namespace solids;

class DoubleMode : public Api {
 protected:
  /// Returns the hits of rays in double and their t.
  struct Found {
    std::vector<double> t;
    std::vector<std::uint32_t> prims;
  };
  static Found trace(const ballot::Scene& scene, const ballot::RayView& rays, std::size_t count,
                     ballot::Query query = {}) {
    Found found{std::vector<double>(count), std::vector<std::uint32_t>(count)};
    query.numeric = "double";
    scene.trace(rays, {.prims = found.prims.data(), .t_double = found.t.data()}, query);
    return found;
  }
};

TEST_F(DoubleMode, PlatesAMillionthApartAreToldApartInABoxOfAThousand) {
  Solid plates;
  for (int i = 0; i < 40; ++i) {
    const auto first = std::uint32_t(plates.positions.size() / 3);
    const double z = 500 + 1e-6 * ((7 * i) % 40);  // in no order
    for (const Vec& v : {Vec{-1e3, -1e3, z}, Vec{1e3, -1e3, z}, Vec{1e3, 1e3, z}, Vec{-1e3, 1e3, z}}) plates.add(v);
    plates.indices.insert(plates.indices.end(), {first, first + 1, first + 2, first, first + 2, first + 3});
  }
  const ballot::Scene scene(*device_, {plates.mesh()});
  std::mt19937 random(5);
  std::uniform_real_distribution<double> at(-900, 900);
  std::vector<double> origins, directions;
  for (int i = 0; i < 300; ++i) {
    const Vec from{at(random), at(random), at(random) > 0 ? 1000.0 : 0.0};
    const Vec d{1e-3 * at(random), 1e-3 * at(random), from[2] > 500 ? -1.0 : 1.0};
    origins.insert(origins.end(), from.begin(), from.end());
    directions.insert(directions.end(), d.begin(), d.end());
  }
  const ballot::RayView rays{.origins = origins, .directions = directions};
  const Found found = trace(scene, rays, 300);
  for (std::size_t i = 0; i < 300; ++i) {
    if (found.prims[i] == ballot::kMiss) continue;
    const double down = directions[3 * i + 2], z = origins[3 * i + 2] + found.t[i] * down;
    EXPECT_NEAR(z, down < 0 ? 500 + 39e-6 : 500, 1e-11);
  }
  EXPECT_LT(std::ranges::count(found.prims, ballot::kMiss), 100);
  const ballot::Lists all = scene.crossings(rays, {.numeric = "double"});
  std::size_t next = 0;
  for (std::size_t i = 0; i < 300; ++i)
    for (std::int64_t k = 0; k < all.counts[i]; ++k, ++next) {
      const bool is_down = directions[3 * i + 2] < 0;
      const std::int64_t plate = is_down ? 39 - k : k;
      EXPECT_EQ((7 * (all.hits[next].prim / 2)) % 40, plate);
    }
}

/// Nested closed surfaces, in centimetres, which nearly touch.
Solid reactor(std::vector<std::uint32_t>& shell_of) {
  Solid solid;
  const double radii[] = {1, 1 + 1e-6, 10, 10.5, 400, 400 + 1e-5, 900};
  for (std::uint32_t s = 0; s < std::size(radii); ++s) {
    add_sphere(solid, 10, {3, -2, 1}, radii[s]);
    shell_of.resize(solid.indices.size() / 3, s);
  }
  return solid;
}

/// Particles that fly from surface to surface of the shells, of whose triangles each is in one.
struct Particles {
  Particles(const Solid& all, const std::vector<std::uint32_t>& shell_of, const Vec& from, std::size_t count)
      : solid(all), shells(shell_of), start(from), at(3 * count), directions(3 * count), left(count), cell(count) {
    for (std::size_t i = 0; i < count; ++i) begin(i);
  }
  void begin(std::size_t i) {
    std::ranges::copy(start, at.begin() + std::ptrdiff_t(3 * i));
    left[i] = ballot::kMiss, cell[i] = 0;
  }
  Vec normal(std::uint32_t prim) const {
    const std::uint32_t* corner = &solid.indices[3 * prim];
    const Vec a = solid.at(corner[0]), e = solid.at(corner[1]) - a, f = solid.at(corner[2]) - a;
    return {e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]};
  }
  Vec direction(std::size_t i) const { return {directions[3 * i], directions[3 * i + 1], directions[3 * i + 2]}; }
  /// Gives a particle a direction, by which it goes on or back into the cell on that side of the surface.
  void turn(std::size_t i, const Vec& d) {
    std::ranges::copy(d, directions.begin() + std::ptrdiff_t(3 * i));
    if (left[i] != ballot::kMiss) cell[i] = shells[left[i]] + (dot(normal(left[i]), d) > 0);
  }
  /// Steps to the surface. Returns false if that is none of the particle's cell.
  bool step(std::size_t i, std::uint32_t prim, double t) {
    if (prim == ballot::kMiss) {
      const bool is_outside = cell[i] == shells.back() + 1;
      begin(i);
      return is_outside;
    }
    const Vec d = direction(i);
    const bool outwards = dot(normal(prim), d) > 0, right = shells[prim] + !outwards == cell[i];
    for (std::size_t k = 0; k < 3; ++k) at[3 * i + k] += t * d[k];
    left[i] = prim;
    return right;
  }

  const Solid& solid;
  const std::vector<std::uint32_t>& shells;
  Vec start;
  std::vector<double> at, directions;
  std::vector<std::uint32_t> left, cell;  // the triangle that was left; the number of shells inside of the particle
};

// Fire, step to the surface, leave it out, find the cell.
TEST_F(DoubleMode, NoParticleIsLost) {
  constexpr std::size_t kHistories = 500, kSteps = 20;
  std::vector<std::uint32_t> shell_of;
  const Solid solid = reactor(shell_of);
  const ballot::Scene scene(*device_, {solid.mesh()});
  Particles particles(solid, shell_of, {3, -2, 1}, kHistories);
  std::mt19937_64 random(9);
  std::normal_distribution<double> any;
  std::vector<std::uint32_t> prims(kHistories);
  std::vector<double> t(kHistories);
  std::size_t lost = 0, hits = 0;
  for (std::size_t step = 0; step < kSteps; ++step) {
    for (std::size_t i = 0; i < kHistories; ++i) {
      const Vec d{any(random), any(random), any(random)};
      particles.turn(i, 1 / std::sqrt(dot(d, d)) * d);
    }
    scene.trace({.origins = particles.at, .directions = particles.directions, .excluded = particles.left},
                {.prims = prims.data(), .t_double = t.data()}, {.numeric = "double"});
    for (std::size_t i = 0; i < kHistories; ++i) {
      hits += prims[i] != ballot::kMiss;
      lost += !particles.step(i, prims[i], t[i]);
    }
  }
  EXPECT_EQ(lost, 0u);
  EXPECT_GT(hits, kHistories * kSteps / 2);
}

TEST_F(DoubleMode, TinyTrianglesBesideLargeOnesAreHit) {
  Solid solid;
  for (const Vec& v : {Vec{-1e3, -1e3, -1}, Vec{1e3, -1e3, -1}, Vec{0, 1e3, -1}}) solid.add(v);
  for (const Vec& v : {Vec{0, 0, 0}, Vec{1e-14, 0, 0}, Vec{0, 1e-14, 0}}) solid.add(v);
  solid.indices = {0, 1, 2, 3, 4, 5};
  const ballot::Scene scene(*device_, {solid.mesh()});
  const std::vector<double> origins{2e-15, 2e-15, 900, 2e-14, 2e-15, 900}, down{0, 0, -1};
  const Found found = trace(scene, {.origins = origins, .directions = down}, 2);
  EXPECT_EQ(found.prims, (std::vector<std::uint32_t>{1, 0}));
  EXPECT_EQ(found.t, (std::vector<double>{900, 901}));
}

TEST_F(DoubleMode, PointsAreAnsweredInDouble) {
  std::vector<std::uint32_t> shell_of;
  Solid solid = reactor(shell_of);
  for (std::size_t i = 0; i < solid.positions.size(); ++i) solid.positions[i] += i % 3 ? 5e6 : 5e5;
  const ballot::Scene scene(*device_, {solid.mesh()});
  const Vec centre{5e5 + 3, 5e6 - 2, 5e6 + 1};
  std::vector<double> points;
  for (const double r : {0.0, 1 + 5e-7, 5.0, 400 + 5e-6, 2000.0})
    points.insert(points.end(), {centre[0], centre[1], centre[2] + r});
  std::vector<double> distances(5), at(15);
  std::vector<std::uint8_t> inside(5);
  std::vector<std::uint32_t> prims(5);
  scene.nearest(points,
                {.prims = prims.data(),
                 .inside = inside.data(),
                 .distances_double = distances.data(),
                 .points_double = at.data()},
                {.numeric = "double"});
  EXPECT_EQ(inside, (std::vector<std::uint8_t>{1, 0, 1, 0, 0}));
  const double slope = std::cos(M_PI / 20);  // of the triangles at the pole
  EXPECT_NEAR(distances[1], slope * 5e-7, 2e-9);
  EXPECT_NEAR(distances[3], slope * 5e-6, 3e-9);
  EXPECT_NEAR(distances[4], 1100, 1e-8);
  EXPECT_EQ(shell_of[prims[4]], 6u);
}

// Instances are placed in double too: hits are those of the moved mesh.
TEST_F(DoubleMode, InstancesOfMeshesInDoubleAreHit) {
  Solid solid;
  add_sphere(solid, 8, {1.0 / 3, 0, 0}, 1);
  std::vector<float> places{1, 0, 0, 10, 0, 1, 0, 0, 0, 0, 1, 0, 0.5f, 0, 0, -5, 0, 0.5f, 0, 0, 0, 0, 0.5f, 3};
  const ballot::Scene scene(*device_, {solid.mesh()}, ballot::instances(places));
  Solid moved;
  add_sphere(moved, 8, {1.0 / 3 + 10, 0, 0}, 1);
  add_sphere(moved, 8, {0.5 / 3 - 5, 0, 3}, 0.5);
  const ballot::Scene flat(*device_, {moved.mesh()});
  std::mt19937 random(5);
  std::uniform_real_distribution<double> any(-1, 1);
  std::vector<double> origins, directions;
  for (int i = 0; i < 500; ++i) {
    const Vec to =
        i % 2 ? Vec{10.3, 0.5 * any(random), 0.5 * any(random)} : Vec{-4.8, 0.3 * any(random), 3 + 0.3 * any(random)};
    const Vec from{3 * any(random), 30 * any(random), 40}, d = to - from;
    origins.insert(origins.end(), from.begin(), from.end());
    directions.insert(directions.end(), d.begin(), d.end());
  }
  const ballot::RayView rays{.origins = origins, .directions = directions};
  const Found a = trace(scene, rays, 500), b = trace(flat, rays, 500);
  std::size_t others = 0;
  for (std::size_t i = 0; i < 500; ++i) {
    const bool hit = std::isfinite(a.t[i]);
    others += hit != std::isfinite(b.t[i]);
    if (hit && std::isfinite(b.t[i])) {
      EXPECT_NEAR(a.t[i], b.t[i], 1e-13);
    }
  }
  EXPECT_LT(others, 2u);
  const auto counted = [&] { scene.count_crossings(rays, {.numeric = "double"}); };
  std::string text;
  EXPECT_EQ(code_of(counted, &text), BALLOT_ERROR_ARGUMENT);
  EXPECT_NE(text.find("instances"), std::string::npos) << text;
}

TEST_F(DoubleMode, MovedVerticesAreThoseInDouble) {
  Solid solid;
  add_sphere(solid, 8, {0, 0, 0}, 1.0 / 3);
  ballot::Scene scene(*device_, {solid.mesh()});
  const std::vector<double> origins{0.01, 0.02, 9}, down{0, 0, -1};
  const ballot::RayView rays{.origins = origins, .directions = down};
  const Found before = trace(scene, rays, 1);
  for (double& x : solid.positions) x *= 2;
  scene.set_vertices(0, std::span<const double>(solid.positions));
  scene.commit();
  const Found after = trace(scene, rays, 1);
  const ballot::Scene fresh(*device_, {solid.mesh()});
  EXPECT_EQ(after.t, trace(fresh, rays, 1).t);
  EXPECT_NE(before.t, after.t);
}

TEST_F(DoubleMode, WhatItDoesNotDoIsRefused) {
  const Grid grid(2);
  const ballot::Scene scene(*device_, {grid.mesh()});
  const std::vector<float> point{0, 0, 1};
  float distance;
  std::string text;
  const auto refused = [&](const auto& call, const char* what) {
    EXPECT_EQ(code_of(call, &text), BALLOT_ERROR_ARGUMENT);
    EXPECT_NE(text.find(what), std::string::npos) << text;
  };
  refused([&] { scene.nearest(point, {.signed_distances = &distance}, {.numeric = "double", .sign = "pseudonormal"}); },
          "pseudonormal");
  const std::vector<ballot::Ray> rays = rays_down(3);
  refused([&] { scene.count_crossings(rays, {.numeric = "double", .alpha = true}); }, "alpha");
  const std::vector<float> centre{0, 0, 0}, radius{1};
  const ballot::Scene spheres(*device_, {ballot::shapes("spheres", centre, radius)});
  std::vector<ballot::Hit> hits(3);
  refused([&] { spheres.trace(rays, hits, {.numeric = "double"}); }, "shapes");
  ballot::Array<ballot::Ray> there(*device_, 3);
  ballot::Array<ballot::Hit> to(*device_, 3);
  refused([&] { scene.trace(there, to, 3, {.numeric = "double", .cull = "back"}); }, "double");
}

}  // namespace

}  // namespace double_mode
