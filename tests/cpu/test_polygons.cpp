// Tests how polygons are cut: areas that are known, in tilted planes, in either direction, and of many corners.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <numbers>

#include "engine/files/polygon.h"

namespace ballot::test {
namespace {

using Outline = std::vector<glm::dvec2>;

/// The triangles of an outline.
struct Cut {
  bool simple = false;
  double area = 0;  // the sum of theirs
  std::size_t count = 0, wrong_points = 0;
};

double cross_of(const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

double shoelace(const Outline& outline) {
  double sum = 0;
  for (std::size_t i = 0; i < outline.size(); ++i)
    sum += cross_of({0, 0}, outline[i], outline[(i + 1) % outline.size()]) / 2;
  return std::abs(sum);
}

/// Cuts an outline that lies in the plane of u and v.
Cut cut(const Outline& outline, const glm::dvec3& u = {1, 0, 0}, const glm::dvec3& v = {0, 1, 0}) {
  std::vector<glm::vec3> polygon;
  for (const glm::dvec2& p : outline) polygon.emplace_back(p.x * u + p.y * v);
  std::vector<std::array<std::uint32_t, 3>> triangles;
  Cut cut{.simple = triangulate(polygon, triangles)};
  cut.count = triangles.size();
  for (const auto& [a, b, c] : triangles) {
    const glm::dvec3 at(polygon[a]);
    cut.area += glm::length(glm::cross(glm::dvec3(polygon[b]) - at, glm::dvec3(polygon[c]) - at)) / 2;
  }
  if (outline.size() > 1000) return cut;
  for (int k = 0; k < 400; ++k) {  // points in a lattice over all, which no outline of these tests touches
    const glm::dvec2 p{-0.4937 + 0.1831 * (k % 20), -0.4913 + 0.1823 * (k / 20)};
    int turns = 0, covers = 0;
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const glm::dvec2 &a = outline[i], &b = outline[(i + 1) % outline.size()];
      if ((a.y > p.y) != (b.y > p.y) && (cross_of(a, b, p) > 0) == (b.y > a.y)) turns += b.y > a.y ? 1 : -1;
    }
    for (const auto& [a, b, c] : triangles) {
      const double x = cross_of(outline[a], outline[b], p), y = cross_of(outline[b], outline[c], p),
                   z = cross_of(outline[c], outline[a], p);
      covers += (x > 0 && y > 0 && z > 0) || (x < 0 && y < 0 && z < 0);
    }
    cut.wrong_points += covers != std::abs(turns);
  }
  return cut;
}

/// Expects that a polygon has this area, from either side and in planes of any direction.
void expect_area(const char* name, Outline outline, double area) {
  for (const bool back : {false, true}) {
    if (back) std::ranges::reverse(outline);
    const Cut flat = cut(outline);
    EXPECT_TRUE(flat.simple) << name;
    EXPECT_EQ(flat.count, outline.size() - 2) << name;
    EXPECT_NEAR(flat.area, area, 1e-6 * area + 1e-12) << name;
    EXPECT_EQ(flat.wrong_points, 0u) << name;
    const glm::dvec3 u = glm::normalize(glm::dvec3(1, 2, -0.5)), w = glm::normalize(glm::dvec3(-3, 1, 2));
    const Cut tilted = cut(outline, u, glm::normalize(w - glm::dot(u, w) * u));
    EXPECT_TRUE(tilted.simple) << name;
    EXPECT_NEAR(tilted.area, area, 1e-5 * area + 1e-12) << name;
  }
}

Outline round(std::size_t corners, auto radius) {
  Outline outline;
  for (std::size_t i = 0; i < corners; ++i) {
    const double angle = 2 * std::numbers::pi * double(i) / double(corners), r = radius(i, angle);
    outline.emplace_back(1.3 + r * std::cos(angle), 1.2 + r * std::sin(angle));
  }
  return outline;
}

TEST(Polygons, CornersThatRepeatSpikesAndStraightOnes) {
  expect_area("a repeated concave corner", {{2, 1}, {1, 1}, {1, 1}, {1, 2}, {0, 2}, {0, 0}, {2, 0}}, 3);
  expect_area("each corner twice", {{2, 1}, {2, 1}, {1, 1}, {1, 1}, {1, 2}, {1, 2}, {0, 2}, {0, 0}, {0, 0}, {2, 0}}, 3);
  expect_area("a spike out of a corner", {{0, 0}, {1, 0}, {1, 1}, {2, 2}, {1, 1}, {0, 1}}, 1);
  expect_area("a spike along an edge", {{0, 0}, {2, 0}, {1, 0}, {1, 1}, {0, 1}}, 1);
  expect_area("a spike into the inside", {{0, 0}, {1, 0}, {1, 1}, {0.5, 0.25}, {1, 1}, {0, 1}}, 1);
  expect_area("a spike of several corners",
              {{0, 0}, {1, 0}, {1, 0.5}, {0.75, 0.5}, {0.25, 0.5}, {1, 0.5}, {1, 1}, {0, 1}}, 1);
  expect_area("corners on edges", {{0, 0}, {1, 0}, {2, 0}, {2, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}}, 4);
  expect_area("a T with corners on edges", {{0, 2}, {0, 1}, {1, 1}, {1, 0}, {2, 0}, {2, 1}, {3, 1}, {3, 2}, {1.5, 2}},
              4);
  expect_area("all on one line", {{0, 0}, {1, 0}, {2, 0}, {1, 0}, {0.5, 0}}, 0);
  expect_area("one point", Outline(7, {1, 1}), 0);
}

TEST(Polygons, EdgesThatTouchAndBridgesToHoles) {
  expect_area("a hole", {{0, 0}, {3, 0}, {3, 3}, {0, 3}, {0, 0}, {1, 1}, {1, 2}, {2, 2}, {2, 1}, {1, 1}}, 8);
  expect_area("two holes by one bridge",
              {{0, 0},
               {3, 0},
               {3, 3},
               {0, 3},
               {0, 1},
               {0.5, 1},
               {0.5, 2},
               {1, 2},
               {1, 1},
               {1.5, 1},
               {1.5, 2},
               {2, 2},
               {2, 1},
               {1.5, 1},
               {1, 1},
               {0.5, 1},
               {0, 1}},
              8);
  expect_area("two halves that meet in a corner", {{0, 0}, {1, 1}, {2, 0}, {2, 2}, {1, 1}, {0, 2}}, 2);
  expect_area("a corner that touches an edge", {{0, 0}, {3, 0}, {3, 3}, {1.5, 0}, {0, 3}}, 4.5);
}

TEST(Polygons, ManyCorners) {
  const auto flower = [](std::size_t, double angle) { return 1 + 0.5 * std::sin(12 * angle); };
  const auto star = [](std::size_t i, double) { return i % 2 == 0 ? 1.0 : 0.3; };
  for (const std::size_t corners : {513u, 600u, 5000u, 100000u})
    expect_area("flower", round(corners, flower), shoelace(round(corners, flower)));
  for (const std::size_t corners : {600u, 100000u})
    expect_area("star", round(corners, star),
                double(corners) / 2 * 0.3 * std::sin(2 * std::numbers::pi / double(corners)));
}

// A corridor that winds around itself. The ears of its long sides hold thousands of corners that go one by one.
TEST(Polygons, SquareSpiralOfManyCorners) {
  constexpr int kSides = 30000;
  Outline left, right;
  glm::dvec2 at{0, 0}, along{1, 0};
  double length = 2;
  for (int side = 0; side < kSides; ++side) {
    const glm::dvec2 before = along;
    at += length * along;
    if (side % 2 == 1) length += 2;
    along = {-along.y, along.x};
    const glm::dvec2 out = before - along;  // of the corner
    left.push_back(at - 0.5 * out), right.push_back(at + 0.5 * out);
  }
  Outline outline = right;
  outline.insert(outline.end(), left.rbegin(), left.rend());
  const Cut spiral = cut(outline);
  EXPECT_TRUE(spiral.simple);
  EXPECT_NEAR(spiral.area / shoelace(outline), 1, 1e-9);
}

TEST(Polygons, ThoseThatCrossThemselvesAreTold) {
  const Cut bow_tie = cut({{0, 0}, {1, 1}, {1, 0}, {0, 1}});
  EXPECT_FALSE(bow_tie.simple);
  EXPECT_LE(bow_tie.area, 1);
  EXPECT_FALSE(cut({{0, 0}, {1, 1}, {2, 2}, {2, 0}, {1, 1}, {0, 2}}).simple);  // in a corner
  const auto at = [](int i) {
    return glm::dvec2(std::cos(4 * std::numbers::pi * i / 5), std::sin(4 * std::numbers::pi * i / 5));
  };
  const Cut pentagram = cut({at(0), at(1), at(2), at(3), at(4)});
  EXPECT_FALSE(pentagram.simple);
  EXPECT_LE(pentagram.area, 4);
  Outline flower = round(5000, [](std::size_t, double angle) { return 1 + 0.5 * std::sin(12 * angle); });
  const double area = shoelace(flower);
  std::swap(flower[100], flower[101]);
  const Cut swapped = cut(flower);
  EXPECT_FALSE(swapped.simple);
  EXPECT_NEAR(swapped.area, area, 0.01 * area);
  Outline tangle;
  for (int i = 0; i < 100000; ++i) tangle.emplace_back(std::fmod(i * 0.6180339887, 1), std::fmod(i * 0.7548776662, 1));
  EXPECT_FALSE(cut(tangle).simple);
}

}  // namespace
}  // namespace ballot::test
