// Tests of refits on the host: sound trees of any size, and triangles that are refused.
#include <gtest/gtest.h>

#include <limits>

#include "engine/core/error.h"
#include "engine/tree/host/build.h"
#include "engine/tree/host/refit.h"
#include "tests/cpu/shapes.h"

namespace ballot {
namespace {

using shapes::Triangles;

/// Expects that the tree of `triangles` is sound once it is refitted to others, and back.
void expect_sound_refits(const Triangles& triangles, const Triangles& moved, const BuildSettings& settings) {
  Bvh bvh = build_bvh(triangles, settings);
  const double built = bvh.stats.sah;
  for (const Triangles* to : {&triangles, &moved, &triangles}) {
    refit_bvh(bvh, *to, settings);
    EXPECT_EQ(check_bvh(bvh, *to, settings), std::vector<std::string>{});
    EXPECT_NEAR(bvh.stats.sah, sah_cost(bvh, settings), 1e-9 * bvh.stats.sah);
  }
  if (bvh.stats.references == triangles.size()) {
    EXPECT_NEAR(bvh.stats.sah, built, 1e-9 * built);
  } else {
    EXPECT_GE(bvh.stats.sah, built);  // spatial splits have clipped boxes
  }
}

TEST(BvhRefit, TreesOfEveryBuilderAreSound) {
  for (const Builder& builder : kBuilders) {
    if (builder.on_device) continue;
    SCOPED_TRACE(builder.name);
    for (const std::size_t count : {1u, 2u, 7u, 900u})
      expect_sound_refits(shapes::soup(count, 0.4f), shapes::soup(count, 0.4f, 5), {.builder = builder.id});
    expect_sound_refits(shapes::slivers(800), shapes::scaled(shapes::slivers(800), -1e6f), {.builder = builder.id});
  }
  Bvh none;
  refit_bvh(none, {}, {});
  EXPECT_TRUE(none.is_empty());
}

// Nodes are refitted in chunks; some wait for children in others. Sums do not depend on who does what.
TEST(BvhRefit, LargeTreesAreSound) {
  const Triangles triangles = shapes::soup(90'000, 0.01f), moved = shapes::soup(90'000, 0.01f, 3);
  const BuildSettings settings{.builder = BuilderId::Fast};
  expect_sound_refits(triangles, moved, settings);
  Bvh bvh = build_bvh(triangles, settings);
  refit_bvh(bvh, moved, settings);
  const double sah = bvh.stats.sah;
  for (int run = 0; run < 3; ++run) {
    refit_bvh(bvh, triangles, settings);
    refit_bvh(bvh, moved, settings);
    EXPECT_EQ(bvh.stats.sah, sah);
  }
}

TEST(BvhRefit, TrianglesAreChecked) {
  const Triangles triangles = shapes::soup(50'000, 0.1f);
  Triangles moved = shapes::soup(50'000, 0.1f, 4);
  moved[40'000][1] = {7, -8, 9};
  const MovedTriangles told = check_moved(triangles, 0, moved, "scene");
  EXPECT_TRUE(told.same_area);
  EXPECT_EQ(told.bounds.lo, bounds_of_vertices(moved, "scene").lo);
  EXPECT_EQ(told.bounds.hi, bounds_of_vertices(moved, "scene").hi);
  Triangles flat = moved;
  flat[49'999][0] = flat[49'999][1];
  EXPECT_FALSE(check_moved(triangles, 0, flat, "scene").same_area);
  EXPECT_FALSE(check_moved(flat, 1, moved, "scene").same_area);
  EXPECT_TRUE(check_moved(flat, 1, flat, "scene").same_area);
  EXPECT_TRUE(check_moved({}, 0, {}, "scene").same_area);
}

/// Returns the text of the error that check_moved() throws.
std::string refusal(const Triangles& before, const Triangles& now) {
  try {
    check_moved(before, 0, now, "cube");
  } catch (const Error& e) {
    return e.what();
  }
  return "none";
}

TEST(BvhRefit, ARefusalNamesTheTriangle) {
  const Triangles triangles = shapes::soup(50'000, 0.1f);
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                          -std::numeric_limits<float>::infinity(), 1e30f, -1.1e12f}) {
    Triangles moved = triangles;
    moved[41'234][2].y = bad;
    EXPECT_NE(refusal(triangles, moved).find("triangle 41234"), std::string::npos) << bad;
  }
  EXPECT_NE(refusal(triangles, Triangles(3, triangles[0])).find("has 50000 triangles, but 3"), std::string::npos);
  Triangles far = triangles;
  far[5][0].x = 1e12f;
  EXPECT_EQ(refusal(triangles, far), "none");
}

}  // namespace
}  // namespace ballot
