// Holds counts and lists of crossings to the exact answers.
#include <cmath>

#include "tests/device/crossing_test.h"

namespace ballot {
namespace {

using namespace harness;

class RayQueriesTest : public CrossingTest {
 protected:
  /// Expects the exact crossings of every ray: its arithmetic must be exact.
  void expect_exact(const shapes::Triangles& triangles, std::span<const Ray> rays, std::size_t at_least) {
    const auto t = make(*gpu_, triangles, {.split_budget = 2});
    RayQueries queries(*gpu_, t->tracer->tree());
    const auto numbers = counts(queries, rays);
    const auto found = lists(queries, rays);
    std::size_t all = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      SCOPED_TRACE(i);
      const std::vector<std::uint32_t> truth = crossings_of(rays[i], triangles);
      EXPECT_EQ(numbers[i], truth.size());
      EXPECT_EQ(prims_of(found[i]), truth);
      all += truth.size();
    }
    expect_first(queries, rays, found);
    EXPECT_GE(all, at_least);
  }
};

TEST_F(RayQueriesTest, RaysThroughEdgesAndVertices) {
  const shapes::Triangles cube = shapes::box({0, 0, 0}, {4, 4, 4});
  const std::pair<const char*, shapes::Triangles> cases[] = {
      {"cube", cube},
      {"nested", shapes::joined(cube, shapes::box({1, 1, 1}, {3, 3, 3}))},
      {"touching", shapes::joined(cube, shapes::box({4, 0, 0}, {6, 4, 4}))},
      {"octahedron", shapes::scaled(shapes::sphere(0), 4)},
      {"coplanar", shapes::joined(shapes::grid(4, 0), shapes::grid(2, 0))},
  };
  for (const auto& [name, triangles] : cases) {
    SCOPED_TRACE(name);
    expect_exact(triangles, lattice_rays(6), 20);
  }
}

// The rounding of such rays moves vertices, so that a few may pass on the other side of an edge; but a closed mesh is
// crossed an even number of times from outside to outside, whatever the ray.
TEST_F(RayQueriesTest, ClosedMeshesAreCrossedAnEvenNumberOfTimes) {
  const shapes::Triangles meshes[] = {shapes::sphere(3), shapes::moved(shapes::sphere(3), {1000, 1e4f, -3e3f})};
  for (const shapes::Triangles& triangles : meshes) {
    const glm::vec3 middle = triangles[0][0] - shapes::sphere(3)[0][0];
    const auto t = make(*gpu_, triangles);
    RayQueries queries(*gpu_, t->tracer->tree());
    std::vector<Ray> rays;
    for (Ray& r : shapes::edge_rays(triangles, 3000, middle + glm::vec3(0, 3, 0.5f))) rays.push_back(r);
    for (const Ray& r : shapes::random_rays(2000, 5, 1.5f)) rays.push_back({r.origin + middle, 0, r.dir, 1e30f});
    const auto numbers = counts(queries, rays);
    std::size_t odd = 0, inside = 0, other = 0;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (i >= 3000) {
        inside += glm::length(glm::dvec3(rays[i].origin - middle)) < 0.98;
        odd += glm::length(glm::dvec3(rays[i].origin - middle)) < 0.98 ? numbers[i] % 2 == 0 : 0;
        continue;
      }
      odd += numbers[i] % 2;
      if (i % 10 == 0) other += numbers[i] != crossings_of(rays[i], triangles).size();
    }
    EXPECT_EQ(odd, 0u);
    EXPECT_GT(inside, 100u);
    EXPECT_LE(other, 60u);  // of 300 rays through edges and vertices, most of which graze none
  }
}

TEST_F(RayQueriesTest, RandomRaysAreThoseOfTheOracle) {
  const shapes::Triangles triangles = shapes::soup(150, 0.7f);
  const auto t = make(*gpu_, triangles, {.split_budget = 2});
  ASSERT_GT(t->bvh.stats.references, triangles.size());
  RayQueries queries(*gpu_, t->tracer->tree());
  std::vector<Ray> rays = shapes::random_rays(300);
  rays[3].t_max = 0.5f;
  rays[4].t_min = 1;
  const auto found = lists(queries, rays);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    std::vector<std::uint32_t> prims;
    for (const Hit& h : found[i]) {
      const ExactSight sight(rays[i], triangles[h.prim]);
      EXPECT_NEAR(h.t, sight.t(), 1e-5 * std::abs(sight.t()));
      prims.push_back(h.prim);
    }
    EXPECT_EQ(prims, crossings_of(rays[i], triangles)) << i;
  }
  expect_first(queries, rays, found);
}

TEST_F(RayQueriesTest, DeadRaysAndEmptyScenes) {
  const auto t = make(*gpu_, shapes::sphere(1));
  RayQueries queries(*gpu_, t->tracer->tree());
  const std::vector<Ray> dead = shapes::dead_rays();
  for (const std::uint32_t n : counts(queries, dead)) EXPECT_EQ(n, 0u);
  EXPECT_TRUE(counts(queries, std::span<const Ray>()).empty());
  const auto empty = make(*gpu_, {});
  RayQueries nothing(*gpu_, empty->tracer->tree());
  const std::vector<Ray> rays = shapes::random_rays(3);
  EXPECT_EQ(counts(nothing, rays), (std::vector<std::uint32_t>{0, 0, 0}));
  EXPECT_TRUE(lists(nothing, rays)[2].empty());
}

// More crossings of a ray than the first pass has room for, and than Mesa 22.3 lets a loop visit.
TEST_F(RayQueriesTest, RaysWithManyCrossings) {
  constexpr std::uint32_t kMany = 100000;
  const auto t = make(*gpu_, shapes::identical(kMany), {.builder = BuilderId::Balanced});
  RayQueries queries(*gpu_, t->tracer->tree());
  const Ray rays[] = {{{0.25f, 0.25f, 2}, 0, {0, 0, -1}, 9}, {{9, 9, 2}, 0, {0, 0, -1}, 9}};
  EXPECT_EQ(counts(queries, rays), (std::vector<std::uint32_t>{kMany, 0}));
  const auto found = lists(queries, rays);
  ASSERT_EQ(found[0].size(), kMany);
  for (std::uint32_t i = 0; i < kMany; ++i) ASSERT_EQ(found[0][i].prim, i);
  expect_first(queries, rays, found);
  expect_first(queries, rays, lists(queries, rays, {.exact = true}), {.exact = true});
}

// More crossings together than are listed at a time, lists that are longer than a row, and than those that have a
// place, and prefix sums over several tiles of rays.
TEST_F(RayQueriesTest, ListsAreTheSameHoweverTheyAreMade) {
  for (const int layers : {30, 500, 2000}) {
    SCOPED_TRACE(layers);
    const auto t = make(*gpu_, shapes::identical(layers), {.builder = BuilderId::Balanced});
    RayQueries queries(*gpu_, t->tracer->tree());
    std::vector<Ray> rays;
    shapes::Random random(5);
    for (int i = 0; i < 5000; ++i) rays.push_back({{random.in(-1, 1), random.in(-1, 1), 2}, 0, {0, 0, -1}, 9});
    const std::vector<std::uint32_t> numbers = counts(queries, rays);
    for (const bool as_gpu : {false, true}) {
      if (as_gpu) StreamRing::of(*gpu_).act_as_gpu(4500);
      std::vector<std::uint32_t> listed;
      std::uint64_t wrong = 0;
      queries.list(source_of(rays), [&](std::uint64_t, std::span<const std::uint32_t> some, std::span<const Hit> hits) {
        listed.insert(listed.end(), some.begin(), some.end());
        for (const std::uint32_t n : some) {
          for (std::uint32_t i = 0; i < n; ++i) wrong += hits[i].prim != i || hits[i].t != 2;
          hits = hits.subspan(n);
        }
      });
      EXPECT_EQ(listed, numbers);
      EXPECT_EQ(wrong, 0u);
    }
    gpu_->stream_ring().reset();
  }
}

}  // namespace
}  // namespace ballot
