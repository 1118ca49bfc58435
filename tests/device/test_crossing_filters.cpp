// Holds mode exact of crossings, masks and culling to the exact answers.
#include <cmath>

#include "engine/core/error.h"
#include "tests/device/crossing_test.h"

namespace ballot {
namespace {

using namespace harness;

class CrossingFilters : public CrossingTest {
 protected:
  /// Expects the exact crossings in mode exact: numbers, order and t.
  void expect_exact(const shapes::Triangles& triangles, std::span<const Ray> rays) {
    const auto t = make(*gpu_, triangles, {.split_budget = 2});
    RayQueries queries(*gpu_, t->tracer->tree());
    const auto numbers = counts(queries, rays, {.exact = true});
    const auto found = lists(queries, rays, {.exact = true}),
               back = lists(queries, rays, {.most = 2, .exact = true, .cull = Cull::Front});
    for (std::size_t i = 0; i < rays.size(); ++i) {
      SCOPED_TRACE(i);
      const std::vector<std::uint32_t> truth =
          is_dead(rays[i]) ? std::vector<std::uint32_t>() : crossings_of(rays[i], triangles);
      ASSERT_EQ(numbers[i], truth.size());
      ASSERT_EQ(prims_of(found[i]), truth);
      for (const Hit& h : found[i]) {
        const ExactSight sight(rays[i], triangles[h.prim]);
        ASSERT_NEAR(h.t, sight.t(), 0x1.1p-24 * std::abs(sight.t()));
      }
      std::vector<std::uint32_t> from_behind = is_dead(rays[i]) ? truth : crossings_of(rays[i], triangles, 1);
      from_behind.resize(std::min<std::size_t>(2, from_behind.size()));
      ASSERT_EQ(prims_of(back[i]), from_behind);
    }
    expect_first(queries, rays, found, {.exact = true});
  }
};

TEST_F(CrossingFilters, ExactDecidesEveryRay) {
  const shapes::Triangles cube = shapes::box({0, 0, 0}, {4, 4, 4}), ball = shapes::sphere(2);
  const std::pair<const char*, shapes::Triangles> cases[] = {
      {"ball", ball},
      {"far away", shapes::moved(ball, {1e7f, -3e6f, 1e5f})},
      {"nested and touching",
       shapes::joined(shapes::joined(cube, shapes::box({1, 1, 1}, {3, 3, 3})), shapes::box({4, 0, 0}, {6, 4, 4}))},
      {"slivers", shapes::slivers(150)},
      {"huge and tiny", shapes::huge_and_tiny(100)},
      {"tiny", shapes::scaled(ball, 1e-30f)},
      {"coplanar", shapes::coplanar(80)},
  };
  for (const auto& [name, triangles] : cases) {
    SCOPED_TRACE(name);
    const glm::vec3 middle = 0.5f * triangles.front()[0] + 0.5f * triangles.back()[2];
    const float size = glm::length(triangles.front()[0] - triangles.back()[2]);
    std::vector<Ray> rays = lattice_rays(4);
    for (const Ray& r : shapes::edge_rays(triangles, 100, middle + glm::vec3(0, 2 * size, 0))) rays.push_back(r);
    for (const Ray& r : shapes::axis_rays(triangles, 100)) rays.push_back(r);
    for (const Ray& r : shapes::random_rays(100, 5, 1.5f)) rays.push_back({r.origin * size + middle, 0, r.dir, 1e30f});
    // Ranges that end on a triangle.
    for (Ray r : shapes::axis_rays(triangles, 60)) {
      r.t_max = 3;
      rays.push_back(r);
      r.t_min = 3, r.t_max = 1e20f;
      rays.push_back(r);
    }
    for (const Ray& r : shapes::dead_rays()) rays.push_back(r);
    expect_exact(triangles, rays);
  }
}

// Rays through corners of a cube, which count as the rule for ties says, from the front, the back, and by masks.
TEST_F(CrossingFilters, MasksAndCulling) {
  const shapes::Triangles triangles =
      shapes::joined(shapes::box({0, 0, 0}, {4, 4, 4}), shapes::box({1, 1, 1}, {3, 3, 3}));
  const auto t = make(*gpu_, triangles);
  RayQueries queries(*gpu_, t->tracer->tree());
  const std::vector<Ray> rays = lattice_rays(3);
  std::vector<std::uint32_t> of_triangles, of_rays;
  for (std::uint32_t i = 0; i < triangles.size(); ++i) of_triangles.push_back(1u << i % 5);
  for (std::uint32_t i = 0; i < rays.size(); ++i) of_rays.push_back(i % 7 == 0 ? 0 : 5u << i % 4);
  std::size_t left_out = 0;
  for (const Cull cull : {Cull::None, Cull::Back, Cull::Front})
    for (const bool exact : {false, true})
      for (const int masks : {0, 1, 2}) {
        CrossingQuery query{.exact = exact, .cull = cull};
        if (masks >= 1) query.triangle_masks = of_triangles;
        const RaySource source =
            source_of(rays, masks == 2 ? std::span<const std::uint32_t>(of_rays) : std::span<const std::uint32_t>());
        const auto numbers = counts(queries, source, query);
        const auto found = lists(queries, source, query);
        expect_first(queries, source, found, query);
        for (std::size_t i = 0; i < rays.size(); ++i) {
          std::vector<std::uint32_t> truth = crossings_of(rays[i], triangles,
                                                          cull == Cull::None   ? 0
                                                          : cull == Cull::Back ? -1
                                                                               : 1);
          const std::size_t all = truth.size();
          if (masks == 2) std::erase_if(truth, [&](std::uint32_t p) { return (of_triangles[p] & of_rays[i]) == 0; });
          left_out += all - truth.size();
          ASSERT_EQ(prims_of(found[i]), truth) << i;
          ASSERT_EQ(numbers[i], truth.size()) << i;
        }
      }
  EXPECT_GT(left_out, 100u);
  // Masks of triangles alone: rays have all bits, and a triangle without any is left out.
  std::vector<std::uint32_t> none(triangles.size(), 0);
  EXPECT_EQ(std::ranges::count(counts(queries, rays, {.triangle_masks = none}), 0u), std::ptrdiff_t(rays.size()));
  EXPECT_THROW(counts(queries, rays, {.triangle_masks = std::span(none).first(3)}), Error);
}

}  // namespace
}  // namespace ballot
