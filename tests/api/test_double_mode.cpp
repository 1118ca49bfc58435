// Numeric mode double by the library: particles are not lost, hits are told apart where float32 cannot, and what is
// refused.
#include <limits>
#include <numeric>

#include "solids.h"
#include "terrain.h"

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

/// Turns vectors of the east, the north and up at 47.3 N, 11.4 E to earth-centred ones, and moves them.
std::vector<double> earth_centred(std::span<const float> vectors, const Vec& to) {
  const double a = 0.8255, b = 0.199;
  const Vec east{-std::sin(b), std::cos(b), 0}, up{std::cos(a) * std::cos(b), std::cos(a) * std::sin(b), std::sin(a)};
  const Vec north = cross(up, east);
  std::vector<double> all;
  for (std::size_t i = 0; i < vectors.size(); i += 3) {
    const Vec at = to + (double(vectors[i]) * east + double(vectors[i + 1]) * north + double(vectors[i + 2]) * up);
    all.insert(all.end(), at.begin(), at.end());
  }
  return all;
}

// The terrain at zero has hits that doubles hardly round. At 6 400 km they round vertices and origins by 2^-31.
TEST_F(DoubleMode, EarthCentredTerrainIsThatAtZero) {
  const terrain::Terrain ground;
  const terrain::Sight sight;
  const Vec centre{4248123.456, 856789.123, 4665432.987};
  const std::vector<double> far = earth_centred(ground.grid.positions, centre),
                            origins = earth_centred(sight.origins, centre),
                            directions = earth_centred(sight.directions, {0, 0, 0});
  const ballot::Scene near_scene(*device_, {ground.grid.mesh()});
  const ballot::Scene far_scene(*device_, {ballot::mesh(far, ground.grid.indices)});
  const Found near = trace(near_scene, {.origins = sight.origins, .directions = sight.directions}, terrain::kRays);
  const Found found = trace(far_scene, {.origins = origins, .directions = directions}, terrain::kRays);
  EXPECT_EQ(found.prims, near.prims);
  std::size_t hits = 0;
  for (std::size_t i = 0; i < terrain::kRays; ++i) {
    if (near.prims[i] == ballot::kMiss || found.prims[i] != near.prims[i]) continue;
    EXPECT_NEAR(found.t[i], near.t[i], 1e-7);  // 2^-31 of a ray that grazes by a hundredth
    ++hits;
  }
  EXPECT_GT(hits, 2000u);
}

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
  std::vector<double> distances(5), sides(5), at(15);
  std::vector<std::uint8_t> inside(5);
  std::vector<std::uint32_t> prims(5);
  scene.nearest(points,
                {.prims = prims.data(),
                 .inside = inside.data(),
                 .distances_double = distances.data(),
                 .points_double = at.data(),
                 .signed_distances_double = sides.data()},
                {.numeric = "double"});
  EXPECT_EQ(inside, (std::vector<std::uint8_t>{1, 0, 1, 0, 0}));
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(sides[i], inside[i] ? -distances[i] : distances[i]);
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

// Numbers that float32 cannot hold make a ray dead and leave the others as they are; columns may be of either type.
TEST_F(DoubleMode, DeadRaysMissAndColumnsAreOfAnyType) {
  Solid solid;
  add_sphere(solid, 8, {5e5, 5e6, 0}, 1.0 / 3);
  const ballot::Scene scene(*device_, {solid.mesh()});
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::vector<double> origins, directions;
  for (int i = 0; i < 8; ++i) {
    origins.insert(origins.end(), {5e5 + 0.01, 5e6 + 0.02, 9});
    directions.insert(directions.end(), {0, 0, -1});
  }
  const ballot::RayView rays{.origins = origins, .directions = directions};
  const Found right = trace(scene, rays, 8);
  EXPECT_EQ(std::ranges::count(right.prims, right.prims[0]), 8);
  origins[3] = 1e200, origins[6] = NAN, origins[11] = -kInfinity;
  directions[12] = 1e39, directions[17] = -1e-50, directions[20] = NAN;
  const Found found = trace(scene, rays, 8);
  for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(found.prims[i], i == 0 || i == 7 ? right.prims[0] : ballot::kMiss) << i;
  EXPECT_EQ(found.t[7], right.t[7]);
  EXPECT_EQ(scene.count_crossings(rays, {.numeric = "double"}), (std::vector<std::int64_t>{2, 0, 0, 0, 0, 0, 0, 2}));

  const std::vector<double> from{5e5 + 0.01, 5e6 + 0.02, 9};
  const std::vector<float> down{0, 0, -1};
  EXPECT_EQ(trace(scene, {.origins = from, .directions = down}, 1).t[0], right.t[0]);

  const std::vector<double> points{5e5, 5e6, 0, 1e200, 0, 0, NAN, 0, 0};
  std::vector<double> distances(3);
  scene.nearest(points, {.distances_double = distances.data()}, {.numeric = "double"});
  EXPECT_LT(distances[0], 1.0 / 3);
  EXPECT_EQ(distances[1], kInfinity);
  EXPECT_EQ(distances[2], kInfinity);
}

TEST_F(DoubleMode, MatricesInDoubleAreGivenOnceAndFinite) {
  Solid solid;
  add_sphere(solid, 8, {0, 0, 0}, 1);
  std::vector<double> places{1, 0, 0, 5e5, 0, 1, 0, 5e6, 0, 0, 1, NAN};
  std::vector<float> single(12);
  std::string text;
  const auto refused = [&](const ballot::Instances& all, const char* what) {
    EXPECT_EQ(code_of([&] { ballot::Scene(*device_, {solid.mesh()}, all); }, &text), BALLOT_ERROR_ARGUMENT);
    EXPECT_NE(text.find(what), std::string::npos) << text;
  };
  refused(ballot::instances(places), "nan");
  places[11] = 1e300;
  refused(ballot::instances(places), "1e");
  ballot::Instances both = ballot::instances(places);
  both.transforms = single.data();
  refused(both, "both transforms and transforms_double are set");
}

// What float32 rounds to one point or to a line is there in double, also once it has moved.
TEST_F(DoubleMode, TrianglesThatFloat32RoundsFlatAreHit) {
  Solid solid;
  std::mt19937 random(2);
  std::uniform_real_distribution<double> at(-1, 1), exponent(-14, -6);
  std::vector<double> origins;
  const auto add = [&](double x, double y, double size) {
    const auto first = std::uint32_t(solid.positions.size() / 3);
    for (const Vec& v : {Vec{x, y, 0}, Vec{x + size, y, 0}, Vec{x, y + size, 0}}) solid.add(v);
    solid.indices.insert(solid.indices.end(), {first, first + 1, first + 2});
  };
  for (int i = 0; i < 200; ++i) {
    const double x = at(random), y = at(random), size = std::pow(10.0, exponent(random));
    add(x, y, size);
    origins.insert(origins.end(), {x + size / 3, y + size / 3, 900});
  }
  const std::size_t tiny = solid.positions.size();
  for (const Vec& v : {Vec{-1e3, -1e3, -1}, Vec{1e3, -1e3, -1}, Vec{0, 1e3, -1}}) solid.add(v);
  solid.indices.insert(solid.indices.end(), {600, 601, 602});
  const std::vector<double> down{0, 0, -1};
  const ballot::RayView rays{.origins = origins, .directions = down};
  std::vector<std::uint32_t> expected(200);
  std::iota(expected.begin(), expected.end(), 0u);
  ballot::Scene scene(*device_, {solid.mesh()});
  EXPECT_EQ(trace(scene, rays, 200).prims, expected);
  const std::vector<float> places{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
  EXPECT_EQ(trace({*device_, {solid.mesh()}, ballot::instances(places)}, rays, 200).prims, expected);
  for (std::size_t i = 2; i < tiny; i += 3) solid.positions[i] = 0.1;
  scene.set_vertices(0, std::span<const double>(solid.positions));
  scene.commit();
  EXPECT_EQ(trace(scene, rays, 200).prims, expected);

  std::vector<double> wide = solid.positions;  // float32 holds these, and then not
  for (std::size_t i = 0; i < tiny; i += 9)
    for (std::size_t k = 0; k < 2; ++k) wide[i + 3 + k] += k ? 0 : 1e-3, wide[i + 6 + k] += k ? 1e-3 : 0;
  for (const char* builder : {"balanced", "device"}) {
    ballot::Scene shrinking(*device_, {ballot::mesh(wide, solid.indices)}, {.builder = builder});
    EXPECT_EQ(std::ranges::count(trace(shrinking, rays, 200).prims, 200u), 0);
    shrinking.set_vertices(0, std::span<const double>(solid.positions));
    shrinking.commit();
    EXPECT_EQ(trace(shrinking, rays, 200).prims, expected) << builder;
  }
  const ballot::Scene other(*device_, {solid.mesh()}, {.builder = "device"});
  EXPECT_EQ(trace(other, rays, 200).prims, expected);
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
