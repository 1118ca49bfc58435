// Tests of trees whose triangles have moved. After a refit, on the device or on the host, a tree must be as sound as a
// new one. In the numeric modes watertight and exact it must give the same hits as a new tree.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/oracle/exact.h"
#include "engine/tree/host/build.h"
#include "engine/tree/host/refit.h"
#include "tests/device/builders.h"
#include "tests/device/ray_sets.h"

namespace ballot {
namespace {

using namespace harness;
using shapes::Triangles;
using tree_shapes::kTreeShapes;
using tree_shapes::TreeShape;

/// Reverses the order of the triangles with area. Turns all triangles by a third of a turn about a diagonal, and halves
/// their coordinates. None of this rounds, so the same triangle numbers have area before and after. A tree that was
/// built from the given triangles fits the returned ones badly.
Triangles dealt_out(const Triangles& triangles) {
  std::vector<std::size_t> proper;
  for (std::size_t i = 0; i < triangles.size(); ++i)
    if (!is_degenerate(triangles[i])) proper.push_back(i);
  Triangles moved = triangles;
  for (std::size_t i = 0; i < proper.size(); ++i) moved[proper[i]] = triangles[proper[proper.size() - 1 - i]];
  for (Triangle& t : moved)
    for (glm::vec3& v : t) v = 0.5f * glm::vec3(v.y, v.z, v.x);
  return moved;
}

/// Triangles far from zero, large enough that rounded coordinates leave them an area.
Triangles soup_far_from_zero() { return shapes::moved(shapes::soup(800, 0.3f), {4096, -8192, 2048}); }

/// Refits a tree on the device to triangles that have moved. Returns false if the tree has to be built anew.
bool refit(DeviceBuild& build, const Triangles& to) {
  build.upload(to);
  build.begin_refit(bounds_of_vertices(to, "moved"));
  return build.end_refit();
}
/// Expects that the tree is sound for the triangles. Reads it back, and expects the cost that the device reported.
void expect_sound(DeviceBuild& build, const Triangles& triangles, const BuildSettings& settings = {}) {
  const double told = build.summary().stats.sah;
  const Bvh& bvh = build.bvh();
  EXPECT_EQ(check_bvh(bvh, triangles, settings), std::vector<std::string>{});
  if (!bvh.nodes.empty()) {
    EXPECT_NEAR(told, sah_cost(bvh, settings), 1e-4 * told);
  }
}

TEST_F(Builders, RefittedTreesAreSound) {
  for (const TreeShape& shape : kTreeShapes) {
    SCOPED_TRACE(shape.name);
    const Triangles triangles = shape.make(), moved = dealt_out(triangles);
    DeviceBuild build(*gpu_, triangles, {});
    const double sah = build.built().sah;
    for (const Triangles* to : {&triangles, &moved, &triangles}) {
      ASSERT_TRUE(refit(build, *to));
      expect_sound(build, *to);
    }
    EXPECT_NEAR(build.built().sah, sah, 1e-5 * sah);
  }
}

TEST_F(Builders, RefitsOfAnyCount) {
  for (const std::size_t count : {1u, 2u, 3u, 5u, 7u, 8u, 31u, 33u, 257u, 1025u})
    for (const std::uint32_t most : {1u, 6u}) {
      const Triangles triangles = shapes::soup(count, 0.5f), moved = shapes::soup(count, 0.3f, 9);
      DeviceBuild build(*gpu_, triangles, {.max_leaf = most});
      ASSERT_TRUE(refit(build, moved)) << count;
      expect_sound(build, moved, {.max_leaf = most});
    }
  const Triangles many = shapes::soup(8000, 0.03f), moved = shapes::soup(8000, 0.03f, 3);
  DeviceBuild build(*gpu_, many, {});
  const double sah = build.built().sah;
  double told = 0;
  for (int run = 0; run < 3; ++run) {
    ASSERT_TRUE(refit(build, moved));
    if (run > 0) {
      EXPECT_EQ(build.built().sah, told);
    }
    told = build.built().sah;
  }
  EXPECT_GT(told, 10 * sah);  // nothing is where it was
  expect_sound(build, moved);
}

// Scenes may grow and shrink a lot, and move far from zero and back.
TEST_F(Builders, RefitsMoveBoundsAnywhere) {
  const Triangles near = shapes::soup(800, 0.3f), far = soup_far_from_zero();
  DeviceBuild build(*gpu_, near, {});
  EXPECT_EQ(build.built().origin, glm::vec3(0));
  for (const Triangles& to : {far, shapes::scaled(near, 0x1p-36f), shapes::scaled(near, 0x1p36f), near}) {
    ASSERT_TRUE(refit(build, to));
    EXPECT_EQ(build.built().origin, box_origin(bounds_of_vertices(to, "moved")));
    expect_sound(build, to);
  }
  ASSERT_TRUE(refit(build, far));
  EXPECT_NE(build.built().origin, glm::vec3(0));
}

// A tree has to be built anew if its triangles with area are no longer the same ones. After a refit has failed for this
// reason, a refit to the original triangles succeeds.
TEST_F(Builders, RefitsNeedTheSameTrianglesWithArea) {
  const Triangles triangles = tree_shapes::with_degenerate();
  Triangles lost = triangles, gained = triangles, both = triangles;
  const auto flatten = [](Triangle& t) { t[1] = t[2]; };
  flatten(lost[1]);
  gained[22] = triangles[1];
  flatten(both[1]);
  both[22] = triangles[1];
  DeviceBuild build(*gpu_, triangles, {});
  for (const Triangles& to : {lost, gained, both}) {
    EXPECT_FALSE(check_moved(triangles, build.summary().stats.degenerate, to, "moved").same_area);
    EXPECT_FALSE(refit(build, to));
    ASSERT_TRUE(refit(build, triangles));
    expect_sound(build, triangles);
  }
  const Triangles flat(9, Triangle{});
  Triangles one = flat;
  one[3] = triangles[1];
  DeviceBuild none(*gpu_, flat, {}), single(*gpu_, one, {});
  EXPECT_FALSE(refit(none, one));
  EXPECT_TRUE(refit(none, flat));
  EXPECT_FALSE(refit(single, flat));
  EXPECT_TRUE(refit(single, one));
  expect_sound(single, one);
}

// Trees of every builder are refitted where they were made, on the device or on the host. Their hits must have the same
// bits as those of a tree that was built from the moved triangles.
void expect_fresh_hits(Context& gpu, const Triangles& triangles, const Query& query) {
  const Triangles moved = dealt_out(triangles);
  const Bvh fresh = build_bvh(moved);
  std::vector<Ray> rays;
  for (const shapes::RaySet& set : shapes::ray_sets(moved, fresh))
    for (std::size_t i = 0; i < set.rays.size(); i += 6) rays.push_back(set.rays[i]);
  std::vector<Hit> expected(rays.size()), hits(rays.size());
  for (const Builder& builder : kBuilders) {
    if (builder.chooses) continue;
    const BuildSettings settings{.builder = builder.id};
    std::shared_ptr<DeviceBuild> there;
    if (builder.on_device) there = std::make_shared<DeviceBuild>(gpu, triangles, settings);
    Bvh bvh = there ? there->summary() : build_bvh(triangles, settings);
    // Kernels are compiled for the facts of a tree. Other tests use these facts too, so their kernels serve here as
    // well. A larger depth is taken only for trees that are deeper.
    TreeFacts facts{.depth = 60, .largest_leaf = MAX_LEAF_TRIANGLES};
    while (facts.depth < std::max(bvh.stats.depth, fresh.stats.depth)) facts.depth *= 4;
    Tracer(gpu, fresh, moved, facts).trace(rays, expected, query);
    Tracer tracer(gpu, bvh, triangles, facts, there);
    tracer.trace(rays, hits, query);  // makes the arrays
    if (there) {
      ASSERT_TRUE(tracer.tree().refit(moved, bounds_of_vertices(moved, "moved")));
      bvh = there->summary();
    } else {
      refit_bvh(bvh, moved, settings);
      EXPECT_EQ(check_bvh(bvh, moved, settings), std::vector<std::string>{}) << builder.name;
      EXPECT_NEAR(bvh.stats.sah, bvh.nodes.empty() ? 0 : sah_cost(bvh, settings), 1e-9 * bvh.stats.sah);
    }
    tracer.moved(bvh, moved, facts);
    tracer.trace(rays, hits, query);
    EXPECT_EQ(count_different(expected, hits), 0u) << builder.name;
  }
}

TEST_F(Builders, RefitsGiveTheHitsOfAFreshBuild) {
  std::size_t dealt = 0;
  for (const TreeShape& shape : kTreeShapes) {
    if (!is_dealt(gpu_->info(), dealt++)) continue;
    SCOPED_TRACE(shape.name);
    expect_fresh_hits(*gpu_, shape.make(), {.method = "while-while"});
  }
}

// In mode exact, no answer of a moved tree is wrong, and all answers are those of a fresh build.
TEST_F(Builders, RefitsInExactHaveNoWrongHit) {
  if (!gpu_->info().float64) GTEST_SKIP() << "the device lacks float64";
  if (!harness::at_default_size(gpu_->info())) GTEST_SKIP() << "lavapipe compiles too long";
  const Query query{.method = "while-while", .numeric = "exact"};
  const Triangles triangles = shapes::grid(24), moved = dealt_out(triangles);
  expect_fresh_hits(*gpu_, triangles, query);
  const TreeFacts facts{.depth = 60, .largest_leaf = MAX_LEAF_TRIANGLES};
  const auto build = std::make_shared<DeviceBuild>(*gpu_, triangles, BuildSettings{});
  Tracer tracer(*gpu_, build->summary(), triangles, facts, build);
  ASSERT_TRUE(tracer.tree().refit(moved, bounds_of_vertices(moved, "moved")));
  const Bvh summary = build->summary();
  tracer.moved(summary, moved, facts);
  const std::vector<Ray> rays = shapes::edge_rays(moved, 2000, {0.3f, 3, 0.2f});
  std::vector<Hit> hits(rays.size());
  tracer.trace(rays, hits, query);
  const ExactOracle oracle(tracer.pair_tree(NodeLayout::Interleaved));
  std::size_t wrong = 0, found = 0;
  const std::vector<ExactHit> truth = oracle.nearest(rays);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    wrong += hits[i].prim != truth[i].prim;
    found += truth[i].prim != NO_HIT;
  }
  EXPECT_EQ(wrong, 0u);
  EXPECT_GT(found, rays.size() / 2);
}

// After a closed mesh has moved, every ray from inside still hits it, even a ray aimed at a vertex or an edge.
TEST_F(Builders, RefittedClosedMeshesDoNotLeak) {
  const Triangles mesh = shapes::sphere(4), moved = dealt_out(mesh);
  std::vector<Ray> rays = shapes::edge_rays(mesh, 4001, {0.01f, 0.02f, -0.015f});
  for (Ray& r : rays) {
    r.origin = 0.5f * glm::vec3(r.origin.y, r.origin.z, r.origin.x);
    r.dir = 0.5f * glm::vec3(r.dir.y, r.dir.z, r.dir.x);
  }
  const TreeFacts facts{.depth = 60, .largest_leaf = MAX_LEAF_TRIANGLES};
  for (const Builder& builder : kBuilders) {
    if (builder.chooses) continue;
    const BuildSettings settings{.builder = builder.id};
    std::shared_ptr<DeviceBuild> there;
    if (builder.on_device) there = std::make_shared<DeviceBuild>(*gpu_, mesh, settings);
    Bvh bvh = there ? there->summary() : build_bvh(mesh, settings);
    Tracer tracer(*gpu_, bvh, mesh, facts, there);
    if (there) {
      ASSERT_TRUE(tracer.tree().refit(moved, bounds_of_vertices(moved, "moved")));
      bvh = there->summary();
    } else {
      refit_bvh(bvh, moved, settings);
    }
    tracer.moved(bvh, moved, facts);
    std::vector<Hit> hits(rays.size());
    tracer.trace(rays, hits, {.method = "while-while"});
    EXPECT_EQ(std::ranges::count(hits, NO_HIT, &Hit::prim), 0) << builder.name;
  }
}

// The device rewrites its arrays in the same buffers, in every layout. The array of bvh4 is rewritten later, when a
// kernel asks for it.
TEST_F(Builders, RefitsMoveArraysOfEveryLayout) {
  const Triangles triangles = shapes::soup(3001, 0.1f), moved = dealt_out(triangles);
  const auto build = std::make_shared<DeviceBuild>(*gpu_, triangles, BuildSettings{});
  const Bvh fresh = build_bvh(moved);
  TreeFacts facts = facts_of(build->summary());  // as in TreesOfTheDeviceAreTracedWhereTheyLie: the same kernels
  facts.depth = std::max(facts.depth, build_bvh(triangles).stats.depth);
  Tracer there(*gpu_, build->summary(), triangles, facts, build),
      host(*gpu_, fresh, moved, {.depth = 60, .largest_leaf = MAX_LEAF_TRIANGLES});
  std::vector<Ray> rays = shapes::morton_primary(fresh.bounds);
  std::vector<Hit> expected(rays.size()), hits(rays.size());
  host.trace(rays, expected, {.method = "while-while"});
  std::vector<Query> queries{{.method = "while-while"}};
  if (harness::at_default_size(gpu_->info())) {  // else lavapipe compiles too long
    queries.push_back({.method = "bvh4"});
    queries.push_back({.method = "frontier"});
    queries.push_back({.method = "frontier", .knobs = {{"layout", "interleaved"}}});
    for (const char* layout : {"paper", "interleaved", "centred", "compact"})
      queries.push_back({.method = "while-while", .knobs = {{"layout", layout}, {"padding", "tree"}}});
  }
  for (const Query& query : queries) there.trace(rays, hits, query);
  const std::uint64_t before = there.tree().generation();
  ASSERT_TRUE(there.tree().refit(moved, bounds_of_vertices(moved, "moved")));
  const Bvh summary = build->summary();
  there.moved(summary, moved, facts);
  EXPECT_NE(there.tree().generation(), before);
  for (const Query& query : queries) {
    there.trace(rays, hits, query);
    EXPECT_EQ(count_different(expected, hits), 0u) << there.variant(query).name();
  }
}

// If the scene moves far from zero, boxes are measured from another point. They are rewritten in the same buffers.
TEST_F(Builders, RefitsMoveArraysFarFromZero) {
  const Triangles triangles = shapes::soup(800, 0.3f), far = soup_far_from_zero();
  const TreeFacts facts{.depth = 60, .largest_leaf = MAX_LEAF_TRIANGLES, .far = true};
  const auto build = std::make_shared<DeviceBuild>(*gpu_, triangles, BuildSettings{});
  const Bvh fresh = build_bvh(far);
  Tracer there(*gpu_, build->summary(), triangles, facts, build), host(*gpu_, fresh, far, facts);
  const std::vector<Ray> rays = shapes::morton_primary(fresh.bounds);
  std::vector<Hit> expected(rays.size()), hits(rays.size());
  host.trace(rays, expected, {.method = "while-while"});
  there.trace(rays, hits, {.method = "while-while"});
  ASSERT_TRUE(there.tree().refit(far, bounds_of_vertices(far, "moved")));
  const Bvh summary = build->summary();
  there.moved(summary, far, facts);
  there.trace(rays, hits, {.method = "while-while"});
  EXPECT_EQ(count_different(expected, hits), 0u);
}

}  // namespace
}  // namespace ballot
