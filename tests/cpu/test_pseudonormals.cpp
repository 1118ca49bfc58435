// Tests of pseudonormals and of the exact side of a point.
#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <numbers>

#include "engine/oracle/nearest.h"
#include "engine/tree/host/pseudonormals.h"
#include "tests/cpu/shapes.h"

namespace ballot {
namespace {

using std::numbers::pi;

std::span<const glm::vec3, PSEUDONORMALS> of(const std::vector<glm::vec3>& all, std::size_t prim) {
  return std::span(all).subspan(PSEUDONORMALS * prim).first<PSEUDONORMALS>();
}

void expect_near(const glm::vec3& found, const glm::dvec3& expected) {
  EXPECT_LT(glm::length(glm::dvec3(found) - expected), 1e-6) << found.x << " " << found.y << " " << found.z;
}

TEST(Pseudonormals, OfATriangleAreItsNormal) {
  const UnsetVector<Triangle> one{{{{0, 0, 0}, {2, 0, 0}, {0, 2, 0}}}};
  const auto all = pseudonormals_of(one);
  const double angles[] = {pi / 2, pi / 4, pi / 4};
  for (std::size_t i = 0; i < 3; ++i) {
    expect_near(all[i], {0, 0, angles[i]});
    expect_near(all[PART_EDGE + i], {0, 0, 1});
  }
  EXPECT_TRUE(pseudonormals_of({}).empty());
}

// However the sides of a box are cut into triangles, three right angles meet at each of its corners.
TEST(Pseudonormals, OfABoxDoNotDependOnItsTriangles) {
  const shapes::Triangles box = shapes::box({-1, -1, -1}, {1, 1, 1});
  const auto all = pseudonormals_of(box);
  for (std::size_t prim = 0; prim < box.size(); ++prim)
    for (std::size_t i = 0; i < 3; ++i) {
      expect_near(of(all, prim)[i], pi / 2 * glm::dvec3(box[prim][i]));
      // The pseudonormal: of a box edge two sides' normals, whose sum is its middle; of a diagonal one normal twice.
      const glm::dvec3 middle = 0.5 * (glm::dvec3(box[prim][i]) + glm::dvec3(box[prim][(i + 1) % 3]));
      const bool diagonal = glm::length(middle) < 1.1;
      expect_near(of(all, prim)[PART_EDGE + i], diagonal ? 2.0 * middle : middle);
    }
}

TEST(Pseudonormals, TrianglesWithoutAreaAddNothing) {
  shapes::Triangles box = shapes::box({-1, -1, -1}, {1, 1, 1});
  const auto before = pseudonormals_of(box);
  box.push_back({{{-1, -1, -1}, {1, 1, 1}, {1, 1, 1}}});
  box.push_back({{{-1, -1, -1}, {0, 0, -0.f}, {1, 1, 1}}});
  const auto after = pseudonormals_of(box);
  for (std::size_t i = 0; i < before.size(); ++i) EXPECT_EQ(before[i], after[i]);
  for (std::size_t i = before.size(); i < after.size(); ++i) EXPECT_EQ(after[i], glm::vec3(0));
}

TEST(Pseudonormals, MinusZeroIsZero) {
  const UnsetVector<Triangle> two{{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}}, {{{0, 0, 0}, {0, -0.f, 1}, {1, -0.f, -0.f}}}};
  const auto all = pseudonormals_of(two);
  expect_near(of(all, 0)[PART_EDGE], {0, 1, 1});
  expect_near(of(all, 1)[PART_EDGE + 2], {0, 1, 1});
}

TEST(ExactPart, RegionsOfATriangle) {
  const Triangle t{{{0, 0, 0}, {2, 0, 0}, {0, 2, 0}}};
  const std::pair<glm::vec3, std::uint32_t> cases[] = {{{0.5f, 0.5f, 7}, PART_INSIDE},
                                                       {{-1, -1, 3}, 0},
                                                       {{4, -1, 0}, 1},
                                                       {{-1, 4, 0}, 2},
                                                       {{1, -1, 3}, PART_EDGE},
                                                       {{2, 2, 1}, PART_EDGE + 1},
                                                       {{-5, 1, 1}, PART_EDGE + 2},
                                                       {{1, 0, 5}, PART_EDGE},
                                                       {{1, 1, -5}, PART_EDGE + 1},
                                                       {{0, 1, 0}, PART_EDGE + 2},
                                                       {{0, 0, 5}, 0},
                                                       {{2, 0, -1}, 1},
                                                       {{0, 2, 0}, 2},
                                                       {{0, -0x1p-140f, 0}, 0},
                                                       {{0x1p-60f, 0x1p-60f, 9}, PART_INSIDE},
                                                       {{0x1p-60f, 0, 9}, PART_EDGE},
                                                       {{0x1p-60f, -1, 0}, PART_EDGE}};
  for (const auto& [point, part] : cases) EXPECT_EQ(exact_part(point, t), part) << point.x << " " << point.y;
}

// Points nearer to the plane than double precision resolves.
TEST(ExactBehind, IsDecidedWithoutRounding) {
  const Triangle t{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  const auto all = pseudonormals_of(std::span(&t, 1));
  const glm::vec3 on(0.25f, 0.25f, 0.5f);
  const float little = 0x1p-100f;
  for (const float offset : {-little, 0.f, little}) {
    const glm::vec3 point(offset, 0.5f, 0.5f);  // nearest to the inside if offset > 0, else to edge 1 2
    EXPECT_EQ(exact_behind(point, t, PART_INSIDE, of(all, 0)), offset < 0);
  }
  for (std::uint32_t part = 0; part <= PART_INSIDE; ++part) {
    EXPECT_FALSE(exact_behind(on + glm::vec3(1), t, part, of(all, 0)));
    EXPECT_TRUE(exact_behind(on - glm::vec3(1), t, part, of(all, 0)));
  }
  EXPECT_FALSE(exact_behind(on, t, PART_INSIDE, of(all, 0)));
  EXPECT_FALSE(exact_behind(t[1], t, 1, of(all, 0)));
}

}  // namespace
}  // namespace ballot
