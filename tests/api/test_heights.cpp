// Meshes of heights: whatever is asked, they answer as the mesh of their triangles.
#include <cmath>

#include "tests/api/api.h"

namespace {

using Pair = std::array<double, 2>;
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// A raster beside its mesh, as a caller would make it.
struct Terrain {
  std::size_t rows, columns;
  std::vector<float> heights;
  Pair spacing{1, 1}, corner{0, 0};

  float& at(std::size_t row, std::size_t column) { return heights[row * columns + column]; }
  ballot::Mesh raster() const { return ballot::heights(heights, columns, spacing, corner); }
  std::vector<double> positions() const {
    std::vector<double> all;
    for (std::size_t r = 0; r < rows; ++r)
      for (std::size_t c = 0; c < columns; ++c) {
        const float h = heights[r * columns + c];
        all.push_back(corner[0] + double(c) * spacing[0]);
        all.push_back(corner[1] + double(r) * spacing[1]);
        all.push_back(std::isnan(h) ? 0 : double(h));
      }
    return all;
  }
  std::vector<std::uint32_t> indices() const {
    std::uint32_t first = 0;
    while (first < heights.size() && std::isnan(heights[first])) ++first;
    std::vector<std::uint32_t> all;
    for (std::size_t r = 0; r + 1 < rows; ++r)
      for (std::size_t c = 0; c + 1 < columns; ++c) {
        const auto a = std::uint32_t(r * columns + c), d = std::uint32_t(a + columns);
        for (const std::array<std::uint32_t, 3>& t : {std::array{a, a + 1, d + 1}, std::array{a, d + 1, d}}) {
          const bool whole = !std::isnan(heights[t[0]] + heights[t[1]] + heights[t[2]]);
          for (const std::uint32_t sample : t) all.push_back(whole ? sample : first);
        }
      }
    return all;
  }
};

Terrain hills(std::size_t rows, std::size_t columns, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> any(0, 2);
  Terrain terrain{rows, columns, {}};
  for (std::size_t i = 0; i < rows * columns; ++i) terrain.heights.push_back(any(random));
  return terrain;
}

/// Rays from above and from the sides; up and down through samples, along rows and diagonals.
std::vector<ballot::Ray> rays_at(const Terrain& terrain, std::size_t count) {
  std::mt19937 random(3);
  const float width = float(double(terrain.columns) * terrain.spacing[0]);
  const float depth = float(double(terrain.rows) * terrain.spacing[1]);
  std::uniform_real_distribution<float> any(0, 1);
  std::vector<ballot::Ray> rays;
  const auto x = [&](double c) { return float(terrain.corner[0] + c * terrain.spacing[0]); };
  const auto y = [&](double r) { return float(terrain.corner[1] + r * terrain.spacing[1]); };
  for (std::size_t i = 0; i < count; ++i)
    rays.push_back({{x(0) + width * any(random), y(0) + depth * any(random), 5 * any(random)},
                    0,
                    {any(random) - 0.5f, any(random) - 0.5f, -any(random)},
                    100});
  for (std::size_t r = 0; r < terrain.rows; ++r)
    for (std::size_t c = 0; c < terrain.columns; ++c) {
      rays.push_back({{x(double(c)), y(double(r)), 8}, 0, {0, 0, -1}, 100});
      rays.push_back({{x(double(c)), y(double(r)), -8}, 0, {0, 0, 1}, 100});
      rays.push_back({{x(double(c)), y(double(r)) - 9, 0.5f}, 0, {0, 1, 0}, 100});
      rays.push_back({{x(double(c)) - 4, y(double(r)) - 4, 0.5f}, 0, {1, 1, 0}, 100});
    }
  return rays;
}

class Heights : public Api {
 protected:
  static std::vector<ballot::Hit> hits_of(const ballot::Scene& scene, const std::vector<ballot::Ray>& rays,
                                          const ballot::Query& query = {}) {
    std::vector<ballot::Hit> hits(rays.size());
    scene.trace(rays, hits, query);
    return hits;
  }
  /// Expects two scenes of the same triangles, bit by bit, and the same answers.
  static void expect_same(const ballot::Scene& a, const ballot::Scene& b, const std::vector<ballot::Ray>& rays) {
    ASSERT_TRUE(same(a.triangles(), b.triangles()));
    EXPECT_TRUE(same(hits_of(a, rays), hits_of(b, rays)));
  }
  static void expect_refused(const ballot::Mesh& mesh, const char* expected) {
    std::string text;
    EXPECT_EQ(code_of([&] { ballot::Scene(*device_, {mesh}); }, &text), BALLOT_ERROR_ARGUMENT);
    EXPECT_NE(text.find(expected), std::string::npos) << text;
  }
  Terrain terrain_ = hills(7, 9, 1);
};

TEST_F(Heights, AnswerAsTheirTriangles) {
  terrain_.spacing = {0.5, 0.75}, terrain_.corner = {-1, 2};
  terrain_.at(2, 3) = terrain_.at(0, 0) = terrain_.at(6, 5) = kNaN;
  const std::vector<double> positions = terrain_.positions();
  const std::vector<std::uint32_t> indices = terrain_.indices();
  const ballot::Scene scene(*device_, {terrain_.raster()}), made(*device_, {ballot::mesh(positions, indices)});
  const std::vector<ballot::Ray> rays = rays_at(terrain_, 3000);
  expect_same(scene, made, rays);
  EXPECT_EQ(scene.indices(0), indices);
  EXPECT_TRUE(same(scene.heights(0), terrain_.heights));
  for (const char* numeric : {"plain", "fast", "exact", "double"})
    EXPECT_TRUE(same(hits_of(scene, rays, {.numeric = numeric}), hits_of(made, rays, {.numeric = numeric}))) << numeric;
  for (const char* method : {"packet", "while-while", "bvh4-turns"})
    EXPECT_TRUE(same(hits_of(scene, rays, {.method = method}), hits_of(made, rays))) << method;
  const ballot::MeshInfo info = scene.meshes()[0];
  EXPECT_STREQ(info.shapes, "heights");
  EXPECT_EQ(info.columns, 9u);
  EXPECT_EQ(info.triangles, 96u);
  EXPECT_EQ(info.spacing[1], 0.75);
  EXPECT_EQ(info.corner[0], -1);
  std::vector<float> points, near(rays.size()), near_made(rays.size());
  for (const ballot::Ray& r : rays) points.insert(points.end(), r.origin, r.origin + 3);
  scene.nearest(points, {.distances = near.data()});
  made.nearest(points, {.distances = near_made.data()});
  EXPECT_TRUE(same(near, near_made));
}

TEST_F(Heights, FarFromZeroAnOriginIsFound) {
  terrain_.spacing = {0.1, 0.3}, terrain_.corner = {500000.3, 5.1e6};
  terrain_.at(3, 3) = kNaN;
  const std::vector<double> positions = terrain_.positions();
  const std::vector<std::uint32_t> indices = terrain_.indices();
  const ballot::Scene scene(*device_, {terrain_.raster()}), made(*device_, {ballot::mesh(positions, indices)});
  ASSERT_TRUE(same(scene.triangles(), made.triangles()));
  EXPECT_NE(scene.info().origin[0], 0);
  EXPECT_GT(scene.meshes()[0].rounding, 0);
  std::vector<double> origins, far(terrain_.heights.size()), near(far.size());
  for (std::size_t i = 0; i < far.size(); ++i)
    origins.insert(origins.end(), {positions[3 * i] - 0.01, positions[3 * i + 1] + 0.01, 9});
  for (const char* numeric : {"watertight", "double"}) {
    scene.trace({.origins = origins, .directions = {0, 0, -1}}, {.t_double = far.data()}, {.numeric = numeric});
    made.trace({.origins = origins, .directions = {0, 0, -1}}, {.t_double = near.data()}, {.numeric = numeric});
    EXPECT_TRUE(same(far, near)) << numeric;
  }
}

TEST_F(Heights, CellsInAPlaneHaveNoGaps) {
  Terrain plane{5, 6, std::vector<float>(30, 0.5f)};
  const ballot::Scene scene(*device_, {plane.raster()});
  const std::vector<double> positions = plane.positions();
  expect_same(scene, {*device_, {ballot::mesh(positions, plane.indices())}}, rays_at(plane, 500));
  std::vector<ballot::Ray> rays;
  for (int r = 0; r <= 32; ++r)
    for (int c = 0; c <= 40; ++c) rays.push_back({{float(c) / 8, float(r) / 8, 2}, 0, {0, 0, -1}, 9});
  for (const ballot::Hit& hit : hits_of(scene, rays)) EXPECT_EQ(hit.t, 1.5f);
}

TEST_F(Heights, ThatMoveAreRefittedAndHolesComeAndGo) {
  const std::vector<ballot::Ray> rays = rays_at(terrain_, 1000);
  const Grid ground(4, -1);
  for (const char* builder : {"balanced", "device"})
    for (const char* layout : {"merge", "separate"}) {
      SCOPED_TRACE(std::string(builder) + ", " + layout);
      Terrain now = terrain_;
      const ballot::SceneOptions options{.builder = builder, .updates = "refit", .layout = layout};
      ballot::Scene scene(*device_, {ground.mesh(), now.raster()}, options);
      const auto move = [&](bool refits) {
        scene.set_heights(1, now.heights);
        scene.commit();
        EXPECT_EQ(scene.info().refits > 0, refits);
        expect_same(scene, {*device_, {ground.mesh(), now.raster()}, options}, rays);
        EXPECT_TRUE(same(scene.heights(1), now.heights));
      };
      now.heights = hills(7, 9, 2).heights;
      move(true);
      now.at(3, 4) = kNaN;
      move(false);
      now.heights = hills(7, 9, 5).heights;
      now.at(3, 4) = kNaN;
      move(true);
      now.at(3, 4) = 1, now.at(0, 0) = kNaN;
      move(false);
    }
}

TEST_F(Heights, AreInstancedAddedAndReplaced) {
  const std::vector<float> matrices{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -1, 0, 3, 1, 0, 0, 1, 0, 0, 2, 4};
  const std::vector<double> positions = terrain_.positions();
  const std::vector<std::uint32_t> indices = terrain_.indices(), which{0, 0};
  const ballot::Instances placed = ballot::instances(matrices, which);
  const std::vector<ballot::Ray> rays = rays_at(terrain_, 2000);
  ballot::Scene scene(*device_, {terrain_.raster()}, placed);
  expect_same(scene, {*device_, {ballot::mesh(positions, indices)}, placed}, rays);
  scene.replace_mesh(0, grid_.mesh());
  const std::uint32_t number = scene.add_mesh(terrain_.raster());
  scene.set_heights(number, hills(7, 9, 4).heights);
  scene.add_instances(ballot::instances(std::span(matrices).first(12), std::vector{number}));
  scene.commit();
  EXPECT_STREQ(scene.meshes()[0].shapes, "triangles");
  EXPECT_EQ(scene.meshes()[0].columns, 0u);
  EXPECT_TRUE(same(scene.heights(number), hills(7, 9, 4).heights));
  Terrain other = hills(7, 9, 4);
  const ballot::Scene alone(*device_, {other.raster()});
  EXPECT_EQ(hits_of(scene, {{{2.25f, 3.5f, 3}, 0, {0, 0, -1}, 9}})[0].t,
            hits_of(alone, {{{2.25f, 3.5f, 3}, 0, {0, 0, -1}, 9}})[0].t);
}

TEST_F(Heights, ValuesAreOfTheirSamples) {
  terrain_.at(2, 2) = kNaN;
  std::vector<float> values;
  for (std::size_t i = 0; i < terrain_.heights.size(); ++i) values.push_back(float(i * i));
  const std::vector<double> positions = terrain_.positions();
  const std::vector<std::uint32_t> indices = terrain_.indices();
  const ballot::Attribute attribute = ballot::attribute("label", values);
  ballot::Mesh raster = terrain_.raster(), mesh = ballot::mesh(positions, indices);
  raster.attributes = mesh.attributes = &attribute, raster.attribute_count = mesh.attribute_count = 1;
  const std::vector<ballot::Ray> rays = rays_at(terrain_, 500);
  const auto values_of = [&](const ballot::Scene& scene) {
    std::vector<float> found(rays.size());
    const ballot::Values wanted{"label", found.data()};
    scene.trace(ballot::rays(rays), {.values = &wanted, .value_count = 1});
    for (float& v : found) v = std::isnan(v) ? -1 : v;
    return found;
  };
  const std::vector<float> found = values_of({*device_, {raster}});
  EXPECT_TRUE(same(found, values_of({*device_, {mesh}})));
  EXPECT_GT(*std::ranges::max_element(found), 0);
}

TEST_F(Heights, WithoutDataThereIsNoSurface) {
  Terrain none{3, 4, std::vector<float>(12, kNaN)};
  none.corner = {10, 20};
  const std::vector<ballot::Ray> rays = rays_at(none, 200);
  const auto count = [&](const ballot::Scene& scene) {
    return std::ranges::count_if(hits_of(scene, rays), [](const ballot::Hit& h) { return h.prim != ballot::kMiss; });
  };
  for (const char* builder : {"balanced", "device"}) {
    ballot::Scene scene(*device_, {none.raster()}, {.builder = builder});
    EXPECT_EQ(count(scene), 0);
    EXPECT_EQ(scene.info().degenerate, 12u);
    std::vector<float> heights(12, 1.f);
    heights[5] = kNaN;
    scene.set_heights(0, heights);
    scene.commit();
    EXPECT_GT(count(scene), 0);
    EXPECT_EQ(scene.info().degenerate, 6u);
    scene.set_heights(0, none.heights);
    scene.commit();
    EXPECT_EQ(count(scene), 0);
  }
}

TEST_F(Heights, BadInput) {
  const std::vector<float>& all = terrain_.heights;
  const auto of = [&](std::size_t count, std::size_t columns) {
    return ballot::heights(std::span(all).first(count), columns);
  };
  expect_refused(of(9, 9), "9 heights in 9 columns; expected two full rows");
  expect_refused(of(6, 1), "6 heights in 1 columns");
  expect_refused(of(63, 0), "63 heights in 0 columns");
  expect_refused(of(62, 9), "62 heights in 9 columns");
  for (const double wrong : {0.0, -1.0, double(NAN), double(INFINITY)}) {
    terrain_.spacing[1] = wrong;
    expect_refused(terrain_.raster(), "spacing of heights is (1, ");
  }
  terrain_.spacing[1] = 1;
  terrain_.corner[0] = NAN;
  expect_refused(terrain_.raster(), "corner of heights is (nan, 0)");
  terrain_.corner[0] = 0, terrain_.spacing[0] = 1e13;
  expect_refused(terrain_.raster(), "within +-1e12");
  terrain_.spacing[0] = 1;
  ballot::Mesh mesh = terrain_.raster();
  mesh.shapes = nullptr;
  expect_refused(mesh, "heights is not NULL, but triangles have none");
  mesh = terrain_.raster();
  mesh.heights = nullptr;
  expect_refused(mesh, "heights is NULL, but heights have some");
  mesh = terrain_.raster();
  mesh.positions = all.data();
  expect_refused(mesh, "positions or indices are set beside heights");
  terrain_.at(2, 4) = INFINITY;
  expect_refused(terrain_.raster(), "the height in row 2, column 4 is inf");
  terrain_.at(2, 4) = 1;
  ballot::Scene scene(*device_, {terrain_.raster(), grid_.mesh()});
  std::string text;
  const auto refused = [&](const char* expected, const auto& call) {
    EXPECT_EQ(code_of(call, &text), BALLOT_ERROR_ARGUMENT);
    EXPECT_NE(text.find(expected), std::string::npos) << text;
  };
  refused("62 vertices, but the mesh was made with 63", [&] { scene.set_heights(0, std::span(all).first(62)); });
  refused("mesh 1: it is not of heights", [&] { scene.set_heights(1, grid_.positions); });
  refused("it is of heights; expected ballot_scene_set_heights()", [&] { scene.set_vertices(0, grid_.positions); });
  refused("mesh 1: it is not of heights", [&] { scene.heights(1); });
  std::vector<float> wrong = all;
  wrong[20] = -2e12f;
  refused("row 2, column 2 is -2000000000000;", [&] { scene.set_heights(0, wrong); });
}

}  // namespace
