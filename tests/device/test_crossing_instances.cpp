// Crossings of scenes of instances. They are, by definition, those of object-space rays (shaders/lib/tree/
// instances.glsl), so they are compared, bit for bit, with queries of the single meshes, and with the exact answers.
#include <algorithm>
#include <cmath>

#include "engine/core/error.h"
#include "tests/device/crossing_test.h"
#include "tests/device/forests.h"

namespace ballot {
namespace {

using namespace forests;

class CrossingInstances : public CrossingTest {
 protected:
  using Lists = std::vector<std::vector<Hit>>;

  static Forest twelve() { return make_forest(three_meshes(), twelve_instances()); }

  /// Rays at random, and rays through corners and edges of the moved triangles.
  static std::vector<Ray> hard_rays(const Forest& forest, std::size_t count) {
    std::vector<Ray> rays = rays_for(forest, count);
    shapes::Random random(11);
    const auto triangles = std::uint32_t(forest.triangle_count());
    for (std::size_t i = 0; i < count; ++i) {
      const Triangle t = forest.triangle(forest.place_of(std::uint32_t(random.in(0, 0.999f) * float(triangles))));
      const glm::vec3 from{random.in(-6, 6), random.in(-6, 6), random.in(3, 6)};
      const glm::vec3 at = i % 2 ? t[i % 3] : 0.5f * (t[i % 3] + t[(i + 1) % 3]);
      rays.push_back({from, 0, at - from, i % 5 ? 1e6f : 1});
    }
    return rays;
  }

  /// The crossings by the definition: the object-space rays of each instance, asked of its mesh alone. `masks` has a
  /// word for each triangle of the scene, or none.
  static Lists defined(const Forest& forest, std::span<const Ray> rays, const CrossingQuery& query) {
    Lists all(rays.size());
    std::vector<std::unique_ptr<DeviceTree>> trees;
    std::vector<std::unique_ptr<RayQueries>> alone;
    for (const MeshTree& mesh : forest.meshes()) {
      trees.push_back(std::make_unique<DeviceTree>(*gpu_, *mesh.bvh, mesh.triangles, facts_of(*mesh.bvh)));
      alone.push_back(std::make_unique<RayQueries>(*gpu_, *trees.back()));
    }
    for (const Instance& instance : forest.instances()) {
      std::vector<Ray> moved(rays.size(), Ray{{0, 0, 0}, 0, {0, 0, 1}, 0});  // dead
      for (std::size_t i = 0; i < rays.size(); ++i)
        if (!is_dead(rays[i])) moved[i] = object_ray(rays[i], instance.map);
      CrossingQuery own = query;
      own.most = kAllHits;
      if (!query.triangle_masks.empty())
        own.triangle_masks =
            query.triangle_masks.subspan(instance.first, forest.meshes()[instance.mesh].triangles.size());
      if (instance.mirrors && query.cull != Cull::None) own.cull = query.cull == Cull::Back ? Cull::Front : Cull::Back;
      const Lists found = lists(*alone[instance.mesh], moved, own);
      for (std::size_t i = 0; i < rays.size(); ++i)
        for (const Hit& h : found[i])
          all[i].push_back({h.t * direction_scale(rays[i]), h.prim + instance.first, h.u, h.v});
    }
    for (std::vector<Hit>& hits : all) std::ranges::stable_sort(hits, {}, &Hit::t);
    return all;
  }

  static void expect_equal(const Lists& found, const Lists& truth) {
    ASSERT_EQ(found.size(), truth.size());
    for (std::size_t i = 0; i < truth.size(); ++i) {
      ASSERT_EQ(prims_of(found[i]), prims_of(truth[i])) << "ray " << i;
      ASSERT_TRUE(truth[i].empty() || std::memcmp(found[i].data(), truth[i].data(), truth[i].size() * sizeof(Hit)) == 0)
          << "ray " << i;
    }
  }
  static std::vector<std::uint32_t> sizes_of(const Lists& all) {
    std::vector<std::uint32_t> sizes;
    for (const auto& list : all) sizes.push_back(std::uint32_t(list.size()));
    return sizes;
  }
};

TEST_F(CrossingInstances, AreThoseOfTheDefinition) {
  Forest forest = twelve();
  DeviceTree tree(*gpu_, forest);
  RayQueries queries(*gpu_, tree);
  const std::vector<Ray> rays = hard_rays(forest, 600);
  std::vector<std::uint32_t> masks;
  for (std::uint32_t i = 0; i < forest.triangle_count(); ++i) masks.push_back(i % 3);
  std::size_t crossings = 0;
  for (const Cull cull : {Cull::None, Cull::Back, Cull::Front})
    for (const bool masked : {false, true}) {
      CrossingQuery query{.cull = cull};
      if (masked) query.triangle_masks = masks;
      const Lists truth = defined(forest, rays, query);
      expect_equal(lists(queries, rays, query), truth);
      EXPECT_EQ(counts(queries, rays, query), sizes_of(truth));
      expect_first(queries, rays, truth, query);
      for (const auto& list : truth) crossings += list.size();
    }
  EXPECT_GT(crossings, 10000u);
}

TEST_F(CrossingInstances, ModeExactIsThatOfIntegers) {
  Forest forest = twelve();
  DeviceTree tree(*gpu_, forest);
  RayQueries queries(*gpu_, tree);
  const std::vector<Ray> rays = hard_rays(forest, 50);
  for (const Cull cull : {Cull::None, Cull::Back, Cull::Front}) {
    const CrossingQuery query{.exact = true, .cull = cull};
    const Lists found = lists(queries, rays, query);
    const auto numbers = counts(queries, rays, query);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      SCOPED_TRACE(i);
      ASSERT_EQ(prims_of(found[i]), crossings_of(rays[i], forest, int(cull == Cull::Front) - int(cull == Cull::Back)));
      ASSERT_EQ(numbers[i], found[i].size());
      for (std::size_t k = 1; k < found[i].size(); ++k)
        ASSERT_LE(found[i][k - 1].t, found[i][k].t + 1e-6f * std::abs(found[i][k].t));
    }
    expect_first(queries, rays, found, query);
  }
}

// The judge of `verify --queries`, in both modes.
TEST_F(CrossingInstances, HoldToTheirBounds) {
  Forest forest = twelve();
  DeviceTree tree(*gpu_, forest);
  RayQueries queries(*gpu_, tree);
  const std::vector<Ray> rays = hard_rays(forest, 500);
  const QueryJudge judge(tree);
  for (const bool exact : {false, true}) {
    RayAnswers answers{.counts = counts(queries, rays, {.exact = exact}),
                       .lists = listed(queries, rays, {.exact = exact}),
                       .first = listed(queries, rays, {.most = 4, .exact = exact}),
                       .most = 4};
    RayErrors errors = judge.rays(rays, answers);
    EXPECT_EQ(errors.lists.checked, rays.size());
    for (const QueryErrors& e : {errors.counts, errors.lists, errors.first}) {
      EXPECT_EQ(e.beyond, 0u);
      EXPECT_TRUE(!exact || e.wrong == 0) << e.wrong;
    }
    // The judge finds an answer that is wrong.
    const auto some = std::size_t(std::ranges::find_if(answers.lists.counts, [](auto n) { return n > 0; }) -
                                  answers.lists.counts.begin());
    ASSERT_LT(some, rays.size());
    answers.lists.hits[0].t *= 1.5f;
    EXPECT_EQ(judge.rays(rays, answers).lists.beyond, 1u);
  }
}

// A mesh that is closed is crossed an even number of times from outside to outside, whatever the matrix.
TEST_F(CrossingInstances, ClosedMeshesAreCrossedAnEvenNumberOfTimes) {
  const Placement placements[] = {{0, moved({0, 0, 0})},
                                  {0, turned(0.3f, 0.7f, {0.5f, -0.5f, 0.5f}, {0.1f, 0, 0})},
                                  {0, turned(1, 2, {1.5f, 0.2f, -0.8f}, {-1, 0.5f, 0})},
                                  {0, transform({1, 0.3f, 0}, {0.9f, 1, 0}, {0, -2, 1e-3f}, {0.3f, 0.1f, -0.2f})},
                                  {0, transform({1e-5f, 0, 0}, {0, 3, 0}, {0, 0, 1}, {0, 0, 0})}};
  Forest forest = make_forest({shapes::sphere(3)}, placements);
  DeviceTree tree(*gpu_, forest);
  RayQueries queries(*gpu_, tree);
  std::vector<Ray> rays = hard_rays(forest, 3000);
  for (Ray& r : rays) {
    if (is_dead(r)) continue;
    r.origin = 40.f * glm::normalize(glm::vec3(r.origin) + glm::vec3(0, 0, 1e-3f)) - 20.f * glm::normalize(r.dir);
    r.t_min = 0, r.t_max = 1e30f;
  }
  const std::size_t aimed = rays.size();
  for (std::size_t i = 0; i < aimed; ++i) {  // through the very corners and edges again
    const Triangle t = forest.triangle(forest.place_of(std::uint32_t(i * 97 % forest.triangle_count())));
    const glm::vec3 from = 30.f * glm::normalize(glm::vec3(1, 0.3f * float(i % 7), 2 - float(i % 5)));
    rays.push_back({from, 0, (i % 2 ? t[i % 3] : 0.5f * (t[0] + t[1])) - from, 1e30f});
  }
  std::size_t crossings = 0;
  for (const bool exact : {false, true}) {
    const auto numbers = counts(queries, rays, {.exact = exact});
    EXPECT_EQ(std::ranges::count_if(numbers, [](std::uint32_t n) { return n % 2 == 1; }), 0);
    for (const std::uint32_t n : numbers) crossings += n;
  }
  EXPECT_GT(crossings, 20000u);
}

TEST_F(CrossingInstances, IdentitiesGiveTheBitsOfTheFlatScene) {
  const shapes::Triangles ball = shapes::sphere(3), soup = shapes::soup(300, 0.4f);
  const Placement placements[] = {{0, {}}, {1, {}}};
  Forest one = make_forest({soup}, std::span(placements).first(1)), two = make_forest({ball, soup}, placements);
  const auto flat_one = make(*gpu_, soup, quick()), flat_two = make(*gpu_, shapes::joined(ball, soup), quick());
  std::vector<Ray> rays = hard_rays(two, 500);
  // Of two instances, mode exact does not order what is at the same t in float32: from far away, everything.
  std::erase_if(rays, [](const Ray& r) { return glm::length(r.origin) > 1e6f; });
  for (const bool exact : {false, true})
    for (const auto& [forest, flat] : {std::pair(&one, flat_one.get()), std::pair(&two, flat_two.get())}) {
      DeviceTree tree(*gpu_, *forest);
      RayQueries queries(*gpu_, tree), of_flat(*gpu_, flat->tracer->tree());
      const CrossingQuery query{.exact = exact};
      expect_equal(lists(queries, rays, query), lists(of_flat, rays, query));
      EXPECT_EQ(counts(queries, rays, query), counts(of_flat, rays, query));
    }
}

// Meshes whose trees have spatial splits, which these queries do without, and instances that move.
TEST_F(CrossingInstances, FollowInstancesThatMove) {
  const auto build = [](std::span<const Triangle> t) { return build_bvh(t, {.split_budget = 2}); };
  std::vector<Placement> placements = twelve_instances();
  Forest split(three_meshes(), placements, build);
  ASSERT_GT(split.summary().stats.references, split.summary().stats.triangles);
  Forest whole = twelve();
  DeviceTree split_tree(*gpu_, split), whole_tree(*gpu_, whole);
  RayQueries of_split(*gpu_, split_tree), of_whole(*gpu_, whole_tree);
  const std::vector<Ray> rays = hard_rays(whole, 300);
  for (int step = 0; step < 3; ++step) {
    for (const bool exact : {false, true}) {
      const Lists found = lists(of_whole, rays, {.exact = exact});
      expect_equal(lists(of_split, rays, {.exact = exact}), found);
      expect_equal(found, exact ? found : defined(whole, rays, {}));
    }
    std::vector<Transform> transforms;
    for (Placement& p : placements) {
      p.transform.m[0][3] += 0.25f;
      p.transform.m[1][0] += step == 0 ? 0.1f : 0;
      if (step == 1) std::swap(p.transform.m[0][0], p.transform.m[0][1]), std::swap(p.transform.m[1], p.transform.m[2]);
      transforms.push_back(p.transform);
    }
    for (DeviceTree* tree : {&split_tree, &whole_tree}) tree->move_instances(transforms);
  }
}

// More crossings than Mesa 22.3 lets a loop visit: in one mesh, of many instances, and in a top-level tree whose boxes
// are all met.
TEST_F(CrossingInstances, RaysWithManyCrossings) {
  constexpr std::uint32_t kMany = 40000;
  const Ray rays[] = {{{0.25f, 0.25f, 2}, 0, {0, 0, -1}, 9}, {{9, 9, 2}, 0, {0, 0, -1}, 9}};
  const std::vector<Placement> two(2), all(kMany);
  Forest forests[] = {make_forest({shapes::identical(kMany)}, two), make_forest({shapes::identical(2)}, all)};
  for (Forest& forest : forests) {
    DeviceTree tree(*gpu_, forest);
    RayQueries queries(*gpu_, tree);
    EXPECT_EQ(counts(queries, rays), (std::vector<std::uint32_t>{2 * kMany, 0}));
    const Lists found = lists(queries, rays);
    ASSERT_EQ(found[0].size(), 2 * kMany);
    for (std::uint32_t i = 0; i < 2 * kMany; ++i) ASSERT_EQ(found[0][i].prim, i);
    expect_first(queries, rays, found);
  }
}

TEST_F(CrossingInstances, EmptyScenesAndWrongMasks) {
  const std::vector<Ray> rays = shapes::random_rays(3), dead = shapes::dead_rays();
  const Placement empty[] = {{0, {}}};
  Forest of_nothing = make_forest({{}}, empty), forest = twelve();
  DeviceTree no_tree(*gpu_, of_nothing), tree(*gpu_, forest);
  RayQueries nothing(*gpu_, no_tree), queries(*gpu_, tree);
  for (const bool exact : {false, true}) {
    EXPECT_EQ(counts(nothing, rays, {.exact = exact}), (std::vector<std::uint32_t>{0, 0, 0}));
    EXPECT_TRUE(lists(nothing, rays, {.exact = exact})[2].empty());
    for (const std::uint32_t n : counts(queries, dead, {.exact = exact})) EXPECT_EQ(n, 0u);
  }
  const std::vector<std::uint32_t> masks(std::size_t(forest.triangle_count()), 0);
  EXPECT_EQ(counts(queries, rays, {.triangle_masks = masks}), (std::vector<std::uint32_t>{0, 0, 0}));
  EXPECT_THROW(counts(queries, rays, {.triangle_masks = std::span(masks).first(3)}), Error);
}

}  // namespace
}  // namespace ballot
