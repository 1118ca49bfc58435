// Coordinates in double: scenes far from zero are counted from an origin, rays from afar are moved before they are
// rounded, and answers are those of the same scene at zero.
#include <limits>

#include "terrain.h"

namespace doubles {

namespace {

using namespace terrain;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::vector<ballot::Hit> trace(const ballot::Scene& scene, const ballot::RayView& rays, const ballot::Query& query) {
  std::vector<ballot::Hit> hits(kRays);
  scene.trace(rays, {.hits = hits.data()}, query);
  return hits;
}

class Doubles : public Api {
 protected:
  ballot::Scene far_scene(const ballot::SceneOptions& options = {}) const {
    return {*device_, {ballot::mesh(far_, terrain_.grid.indices)}, options};
  }
  const Terrain terrain_;
  const Sight sight_;
  const std::vector<double> far_ = moved(terrain_.grid.positions, kUtm);
  const std::vector<double> far_origins_ = moved(sight_.origins, kUtm);
  const ballot::RayView near_rays_{.origins = sight_.origins, .directions = sight_.directions};
  const ballot::RayView far_rays_{.origins = far_origins_, .directions = sight_.directions};
};

TEST_F(Doubles, HitsOfEveryMethodAreThoseAtZero) {
  const ballot::Scene near(*device_, {terrain_.grid.mesh()}), far = far_scene();
  const ballot::SceneInfo info = far.info();
  EXPECT_LT(std::abs(info.origin[0] - kUtm[0] - 500), 300);
  EXPECT_LT(std::abs(info.origin[1] - kUtm[1] - 500), 300);
  EXPECT_EQ(near.info().origin[1], 0);
  EXPECT_EQ(far.meshes()[0].rounding, 0);  // 64ths are exact about the origin
  for (const std::string& method : ballot::names(BALLOT_NAMES_METHODS))
    for (const char* numeric : {"watertight", "exact", "double"}) {
      if (numeric == std::string_view("double") && !method.starts_with("bvh")) continue;  // compiles for long
      SCOPED_TRACE(method + " " + numeric);
      const ballot::Query query{.method = method, .numeric = numeric};
      const auto truth = trace(near, near_rays_, query);
      EXPECT_TRUE(same(trace(far, far_rays_, query), truth));
      EXPECT_GT(std::ranges::count_if(truth, [](const ballot::Hit& h) { return h.prim != ballot::kMiss; }), 2000);
    }
}

TEST_F(Doubles, OtherAnswersAreThoseAtZero) {
  const ballot::Scene near(*device_, {terrain_.grid.mesh()}), far = far_scene();
  const auto truth = near.crossings(near_rays_), found = far.crossings(far_rays_);
  EXPECT_EQ(found.counts, truth.counts);
  EXPECT_TRUE(same(found.hits, truth.hits));
  EXPECT_EQ(far.count_crossings(far_rays_), near.count_crossings(near_rays_));
  const ballot::Query three{.first = 3};
  std::vector<ballot::Hit> a(3 * kRays), b(3 * kRays);
  near.trace(near_rays_, {.hits = a.data()}, three);
  far.submit(far_rays_, {.hits = b.data()}, three).wait();
  EXPECT_TRUE(same(a, b));
  std::vector<std::uint8_t> seen(kRays), hidden(kRays);
  near.trace(near_rays_, {.occluded = seen.data()}, {.any = true});
  far.trace(far_rays_, {.occluded = hidden.data()}, {.any = true});
  EXPECT_EQ(seen, hidden);
}

TEST_F(Doubles, PositionsAndDistancesAreInDouble) {
  const ballot::Scene far = far_scene();
  std::vector<double> t(kRays), at(3 * kRays);
  std::vector<float> single(3 * kRays), t_single(kRays);
  std::vector<std::uint32_t> prims(kRays);
  far.trace(far_rays_, {.t = t_single.data(),
                        .prims = prims.data(),
                        .positions = single.data(),
                        .t_double = t.data(),
                        .positions_double = at.data()});
  const std::vector<std::uint32_t>& indices = terrain_.grid.indices;
  double largest = 0, largest_single = 0;
  for (std::size_t i = 0; i < kRays; ++i) {
    if (prims[i] == ballot::kMiss) {
      EXPECT_EQ(t[i], kInfinity);
      continue;
    }
    const auto corner = [&](std::size_t k, std::size_t axis) { return far_[3 * indices[3 * prims[i] + k] + axis]; };
    double normal[3], above = 0, length = 0;  // the distance of the position from the triangle's plane
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t a = (k + 1) % 3, b = (k + 2) % 3;
      normal[k] = (corner(1, a) - corner(0, a)) * (corner(2, b) - corner(0, b)) -
                  (corner(1, b) - corner(0, b)) * (corner(2, a) - corner(0, a));
      above += normal[k] * (at[3 * i + k] - corner(0, k)), length += normal[k] * normal[k];
      EXPECT_NEAR(at[3 * i + k], far_origins_[3 * i + k] + t[i] * double(sight_.directions[3 * i + k]), 1e-8);
      largest_single = std::max(largest_single, std::abs(at[3 * i + k] - double(single[3 * i + k])));
    }
    largest = std::max(largest, std::abs(above) / std::sqrt(length));
    EXPECT_NEAR(t[i], double(t_single[i]), 1e-3);
  }
  EXPECT_LT(largest, 1e-8);          // a unit of the last place of 5e6 is 9e-10
  EXPECT_LT(largest_single, 0.251);  // of float32 0.5
}

TEST_F(Doubles, PointsAreThoseAtZero) {
  const ballot::Scene near(*device_, {terrain_.grid.mesh()}), far = far_scene();
  std::vector<float> truth(kRays), found(kRays);
  std::vector<double> in_double(kRays), at(3 * kRays);
  std::vector<std::uint32_t> a(kRays), b(kRays);
  near.nearest(sight_.origins, {.distances = truth.data(), .prims = a.data()});
  far.nearest(
      far_origins_,
      {.distances = found.data(), .prims = b.data(), .distances_double = in_double.data(), .points_double = at.data()});
  std::size_t others = 0;
  for (std::size_t i = 0; i < kRays; ++i) {
    EXPECT_NEAR(truth[i], found[i], 1e-3);
    EXPECT_NEAR(in_double[i], double(found[i]), 1e-3);
    double sum = 0;
    for (std::size_t k = 0; k < 3; ++k) sum += std::pow(at[3 * i + k] - far_origins_[3 * i + k], 2);
    EXPECT_NEAR(std::sqrt(sum), in_double[i], 1e-9);
    others += a[i] != b[i];
  }
  EXPECT_LT(others, 4u);  // ties within rounding
  const ballot::Lists within = far.within({.at = far_origins_, .limit = 100});
  EXPECT_EQ(within.counts, near.within({.at = sight_.origins, .limit = 100}).counts);
}

/// Returns the triangles of a sphere of radius 1 about zero.
std::vector<float> sphere(std::size_t rows) {
  std::vector<float> corners;
  const auto add = [&](std::size_t row, std::size_t column) {
    const double a = M_PI * double(row) / double(rows), b = M_PI * double(column % (2 * rows)) / double(rows);
    const double ring = row == 0 || row == rows ? 0 : std::sin(a);
    corners.insert(corners.end(), {float(ring * std::cos(b)), float(ring * std::sin(b)), float(std::cos(a))});
  };
  for (std::size_t r = 0; r < rows; ++r)
    for (std::size_t c = 0; c < 2 * rows; ++c) {
      if (r > 0) add(r, c), add(r + 1, c), add(r, c + 1);
      if (r + 1 < rows) add(r, c + 1), add(r + 1, c), add(r + 1, c + 1);
    }
  return corners;
}

TEST_F(Doubles, RaysFromAfarHitASphere) {
  const ballot::Scene scene(*device_, {ballot::mesh(sphere(24))});
  constexpr double kFar = 6e7;
  std::vector<double> origins, directions;
  std::mt19937 random(5);
  std::normal_distribution<double> any;
  for (int i = 0; i < 1000; ++i) {
    const std::array<double, 3> d{any(random), any(random), any(random)};
    const double length = std::hypot(d[0], d[1], d[2]);
    for (const double x : d) origins.push_back(-x / length * kFar), directions.push_back(x / length);
  }
  const ballot::RayView rays{.origins = origins, .directions = directions};
  for (const std::string& method : ballot::names(BALLOT_NAMES_METHODS)) {
    std::vector<double> t(1000);
    std::vector<float> single(1000);
    scene.trace(rays, {.t = single.data(), .t_double = t.data()}, {.method = method});
    for (std::size_t i = 0; i < t.size(); ++i) {
      EXPECT_LT(kFar - 1 - 1e-6, t[i]) << method;
      EXPECT_LT(t[i], kFar - 0.98) << method;
      EXPECT_NEAR(single[i], t[i], 4) << method;
    }
  }
  EXPECT_EQ(scene.count_crossings(rays), std::vector<std::int64_t>(1000, 2));
  const std::vector<double> bound(1, kFar);
  const ballot::RayView ranges[] = {{.origins = origins, .directions = directions, .t_min = bound},
                                    {.origins = origins, .directions = directions, .t_max = bound}};
  for (const ballot::RayView& range : ranges)  // the far wall, or the near one
    EXPECT_EQ(scene.count_crossings(range), std::vector<std::int64_t>(1000, 1));
}

/// Returns a 3 x 4 matrix that turns by an angle about z and moves.
template <class Number>
std::vector<Number> turned(double angle, const std::array<double, 3>& to) {
  std::vector<Number> m{Number(std::cos(angle)), -Number(std::sin(angle)), 0, Number(to[0]),
                        Number(std::sin(angle)), Number(std::cos(angle)),  0, Number(to[1])};
  m.insert(m.end(), {0, 0, 1, Number(to[2])});
  return m;
}

class PlacedDoubles : public Doubles {
 protected:
  /// Two tiles that are turned, at a place.
  ballot::Scene placed(const std::array<double, 3>& at, const ballot::SceneOptions& options) const {
    std::vector<double> all = turned<double>(0.5, {at[0] + 600, at[1], at[2]});
    std::ranges::copy(turned<double>(0.25, {at[0] - 600, at[1] + 100, at[2]}), std::back_inserter(all));
    return {*device_, {terrain_.grid.mesh()}, ballot::instances(all), options};
  }
};

TEST_F(PlacedDoubles, InstancesAreAsPreciseAsAtZero) {
  const ballot::Scene near = placed({0, 0, 0}, {});
  ballot::Scene far = placed(kUtm, {.origin = {kUtm[0], kUtm[1], 0}});
  const auto truth = trace(near, near_rays_, {});
  EXPECT_TRUE(same(trace(far, far_rays_, {}), truth));
  EXPECT_EQ(far.info().trees, 1u);

  // An origin that is found: matrices are rounded otherwise, by 2^-24 of the scene.
  const ballot::Scene found = placed(kUtm, {});
  EXPECT_NE(found.info().origin[0], 0);
  const auto hits = trace(found, far_rays_, {});
  std::size_t others = 0;
  for (std::size_t i = 0; i < kRays; ++i) {
    others += hits[i].prim != truth[i].prim;
    if (hits[i].prim != truth[i].prim || truth[i].prim == ballot::kMiss) continue;
    EXPECT_NEAR(hits[i].t, truth[i].t, 5e-3);
  }
  EXPECT_LT(others, 4u);

  // Edits name the world.
  const ballot::Scene moved_near = placed({2, 3, 0}, {});
  std::vector<double> to = turned<double>(0.5, {kUtm[0] + 602, kUtm[1] + 3, 0});
  std::ranges::copy(turned<double>(0.25, {kUtm[0] - 598, kUtm[1] + 103, 0}), std::back_inserter(to));
  far.set_transforms(to);
  far.commit();
  EXPECT_TRUE(same(trace(far, far_rays_, {}), trace(moved_near, near_rays_, {})));
  const std::vector<std::uint32_t> second{1};
  far.remove_instances(second);
  far.commit();
  const auto numbers = far.add_instances(ballot::instances(std::span<const double>(to).subspan(12)));
  far.commit();
  EXPECT_TRUE(same(trace(far, far_rays_, {}), trace(moved_near, near_rays_, {})));
  far.set_transforms(numbers, std::span<const double>(to).subspan(12));
  far.set_transforms(numbers, turned<float>(0.25, {kUtm[0] - 598, kUtm[1] + 103, 0}));  // float32 holds these
  far.commit();
  EXPECT_TRUE(same(trace(far, far_rays_, {}), trace(moved_near, near_rays_, {})));
}

TEST_F(PlacedDoubles, MeshesHaveOriginsOfTheirOwn) {
  const ballot::Scene near(*device_, {terrain_.grid.mesh()});
  const std::vector<double> back = turned<double>(0, {-kUtm[0], -kUtm[1], 0});
  ballot::Scene far(*device_, {ballot::mesh(far_, terrain_.grid.indices)}, ballot::instances(back));
  EXPECT_EQ(far.info().origin[0], 0);
  EXPECT_NE(far.meshes()[0].origin[0], 0);
  const auto truth = trace(near, near_rays_, {});
  const auto agree = [&](const std::vector<ballot::Hit>& hits) {
    std::size_t others = 0;
    for (std::size_t i = 0; i < kRays; ++i) others += hits[i].prim != truth[i].prim;
    EXPECT_LT(others, 4u);
  };
  agree(trace(far, near_rays_, {}));
  far.set_vertices(0, std::vector<double>(far_));
  far.commit();
  agree(trace(far, near_rays_, {}));
  far.replace_mesh(0, ballot::mesh(far_, terrain_.grid.indices));
  far.commit();
  agree(trace(far, near_rays_, {}));
}

TEST_F(PlacedDoubles, VerticesMoveInTheWorld) {
  const std::vector<double> lifted = moved(terrain_.grid.positions, {kUtm[0], kUtm[1], 8});
  ballot::Scene far = far_scene({.origin = {kUtm[0], kUtm[1], 0}});
  far.set_vertices(0, lifted);
  far.commit();
  const std::vector<double> near_lifted = moved(terrain_.grid.positions, {0, 0, 8});
  const ballot::Scene near(*device_, {ballot::mesh(near_lifted, terrain_.grid.indices)});
  EXPECT_EQ(near.info().origin[2], 0);
  EXPECT_TRUE(same(trace(far, far_rays_, {}), trace(near, near_rays_, {})));
  const std::vector<float> coarse(lifted.begin(), lifted.end());
  far.set_vertices(0, coarse);
  far.commit();
  EXPECT_LT(far.meshes()[0].hi[0], 1001);
}

TEST_F(PlacedDoubles, PosesAndViewsAreOfTheWorld) {
  const ballot::Scene near(*device_, {terrain_.grid.mesh()}), far = far_scene({.origin = {kUtm[0], kUtm[1], 0}});
  const auto seen = [&](const ballot::Scene& scene, const std::array<double, 3>& from) {
    const std::vector<double> pose = turned<double>(0, {from[0] + 500, from[1] + 500, 200});
    std::vector<ballot::Hit> hits(kRays);
    scene.trace({.origins = {0, 0, 0}, .directions = sight_.directions, .poses = pose}, {.hits = hits.data()});
    return hits;
  };
  EXPECT_TRUE(same(seen(far, kUtm), seen(near, {0, 0, 0})));
  const auto drawn = [&](const ballot::Scene& scene, const std::array<double, 3>& from) {
    const ballot::View view{.eye = {from[0] + 500, from[1] - 300, 300}, .target = {from[0] + 500, from[1] + 500, 0}};
    return scene.render(view, {.width = 32, .height = 32});
  };
  EXPECT_EQ(drawn(far, kUtm), drawn(near, {0, 0, 0}));
}

// Rays that the device makes are those at zero, moved: so are their hits.
TEST_F(PlacedDoubles, RaysOfViewsAreOfTheWorld) {
  const ballot::Scene near(*device_, {terrain_.grid.mesh()}), far = far_scene({.origin = {kUtm[0], kUtm[1], 0}});
  const auto view = [](const std::array<double, 3>& from) {
    return ballot::View{.eye = {from[0] + 500, from[1] - 300, 300}, .target = {from[0] + 500, from[1] + 500, 0}};
  };
  for (const char* kind : {"primary", "ao"}) {
    const std::vector<ballot::Ray> at_zero = near.make_rays(view({0, 0, 0}), kind, 32, 32);
    const std::vector<ballot::RayDouble> rays = far.make_rays_double(view(kUtm), kind, 32, 32);
    ASSERT_EQ(rays.size(), at_zero.size());
    std::vector<double> origins, directions, starts, ends;
    for (std::size_t i = 0; i < rays.size(); ++i)
      for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_NEAR(rays[i][k] - kUtm[k], double(at_zero[i].origin[k]), 1e-9);
        EXPECT_EQ(rays[i][4 + k], double(at_zero[i].dir[k]));
        origins.push_back(rays[i][k]), directions.push_back(rays[i][4 + k]);
      }
    for (const ballot::RayDouble& ray : rays) starts.push_back(ray[3]), ends.push_back(ray[7]);
    std::vector<ballot::Hit> found(rays.size()), truth(rays.size());
    far.trace({.origins = origins, .directions = directions, .t_min = starts, .t_max = ends}, {.hits = found.data()});
    near.trace(at_zero, {.hits = truth.data()});
    EXPECT_TRUE(same(found, truth)) << kind;
    EXPECT_GT(std::ranges::count_if(truth, [](const ballot::Hit& h) { return h.prim != ballot::kMiss; }), 20);
  }
  EXPECT_EQ(near.make_rays_double(view({0, 0, 0}), "primary", 8, 8)[5][4],
            double(near.make_rays(view({0, 0, 0}), "primary", 8, 8)[5].dir[0]));
  std::string text;
  EXPECT_EQ(code_of([&] { far.make_rays({}, "primary", 4, 4); }, &text), BALLOT_ERROR_ARGUMENT);
  EXPECT_NE(text.find("(500000, 5000000, 0)"), std::string::npos) << text;
  EXPECT_NE(text.find("ballot_make_rays_double()"), std::string::npos) << text;
}

TEST_F(PlacedDoubles, BadInput) {
  const auto refused = [&](const ballot::Mesh& mesh, const char* expected, const ballot::SceneOptions& options = {}) {
    std::string text;
    EXPECT_EQ(code_of([&] { ballot::Scene(*device_, {mesh}, options); }, &text), BALLOT_ERROR_ARGUMENT);
    EXPECT_NE(text.find(expected), std::string::npos) << text;
  };
  for (const double wrong : {double(NAN), kInfinity, 1e300, -1e13}) {
    std::vector<double> positions = far_;
    positions[9 * 3 + 1] = wrong;
    refused(ballot::mesh(positions, terrain_.grid.indices), wrong == -1e13 ? "within +-1e12" : "vertex 9 ");
  }
  ballot::Mesh both = ballot::mesh(far_, terrain_.grid.indices);
  both.positions = terrain_.grid.positions.data();
  refused(both, "both positions and positions_double are set");
  const ballot::Mesh mesh = ballot::mesh(far_, terrain_.grid.indices);
  refused(mesh, "scene: origin is", {.origin = {NAN, 0, 0}});
  ballot::Mesh wrong_origin = mesh;
  wrong_origin.origin[2] = kInfinity;
  refused(wrong_origin, "mesh 0: origin is");
  ballot::Mesh wrong_stride = mesh;
  wrong_stride.position_stride = 12;
  refused(wrong_stride, "position_stride is 12");
  std::string text;
  const ballot::Array<ballot::Vertex> there(*device_, 3);
  EXPECT_EQ(code_of([&] { ballot::Scene(*device_, {mesh, ballot::mesh(there)}); }, &text), BALLOT_ERROR_ARGUMENT);
  EXPECT_NE(text.find("BallotSceneOptions::origin"), std::string::npos) << text;

  EXPECT_EQ(code_of(
                [&] {
                  ballot::Scene::load(*device_, "a.obj", {.origin = {1, 0, 0}});
                },
                &text),
            BALLOT_ERROR_ARGUMENT);
  EXPECT_NE(text.find("origin is (1, 0, 0)"), std::string::npos) << text;

  const ballot::Scene far = far_scene();
  const ballot::Array<ballot::Ray> rays(*device_, 4);
  ballot::Array<double> t(*device_, 4);
  EXPECT_EQ(code_of([&] { far.trace(rays, {{"t_double", t}}, 4); }, &text), BALLOT_ERROR_ARGUMENT);
  EXPECT_NE(text.find("t_double goes to the host's memory alone"), std::string::npos) << text;
}

TEST_F(PlacedDoubles, ShapesAreInDoubleToo) {
  const std::vector<double> centers{kUtm[0] + 0.3, kUtm[1], 1, kUtm[0] + 4, kUtm[1], 1};
  const std::vector<float> radii{1, 0.5f};
  ballot::Mesh spheres{.vertex_count = 2, .shapes = "spheres", .radii = radii.data()};
  spheres.positions_double = centers.data();
  const ballot::Scene scene(*device_, {spheres});
  const std::vector<double> origins{kUtm[0] + 0.3, kUtm[1], 9, kUtm[0] + 4, kUtm[1], 1e8};
  double t[2], at[6], distances[2];
  scene.trace({.origins = origins, .directions = {0, 0, -1}}, {.t_double = t, .positions_double = at});
  EXPECT_NEAR(t[0], 7, 1e-5);
  EXPECT_NEAR(t[1], 1e8 - 1.5, 1e-5);
  EXPECT_NEAR(at[2], 2, 1e-5);
  EXPECT_NEAR(at[3], kUtm[0] + 4, 1e-8);
  scene.nearest(std::vector<double>{kUtm[0] + 0.3, kUtm[1], 9, kUtm[0] + 4, kUtm[1], 3},
                {.distances_double = distances});
  EXPECT_NEAR(distances[0], 7, 1e-5);
  EXPECT_NEAR(distances[1], 1.5, 1e-5);
}

TEST_F(PlacedDoubles, SizesThatNoOriginHelpsAreTold) {
  std::vector<double> positions = far_;
  positions.insert(positions.end(), {-3e8, 0, 0, -3e8 + 0.1, 1, 0, -3e8, 1, 0});
  std::vector<std::uint32_t> indices = terrain_.grid.indices;
  const auto last = std::uint32_t(positions.size() / 3 - 3);
  indices.insert(indices.end(), {last, last + 1, last + 2});
  const ballot::Scene scene(*device_, {ballot::mesh(positions, indices)});
  EXPECT_EQ(scene.info().origin[0], 0);
  EXPECT_GT(scene.meshes()[0].rounding, 0.09);
  EXPECT_LT(scene.meshes()[0].rounding, std::ldexp(3e8, -24) * 1.8);
}

}  // namespace

}  // namespace doubles
