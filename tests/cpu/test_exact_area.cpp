// Tests of areas without rounding, against integers.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "engine/core/unit_normal.h"
#include "engine/model/scene.h"
#include "engine/oracle/predicates.h"
#include "engine/tree/host/build.h"

namespace ballot {
namespace {

/// Returns a component of the cross product of the edges, as an exact number.
Dyadic component(const Triangle& t, int i) {
  const int j = (i + 1) % 3, k = (i + 2) % 3;
  const auto edge = [&](std::size_t to, int axis) { return Dyadic(t[to][axis]) - Dyadic(t[0][axis]); };
  return edge(1, j) * edge(2, k) - edge(1, k) * edge(2, j);
}

/// Expects the unit normal to be that of a right cross product, within its bound.
void expect_unit_normal(const Triangle& t, const glm::dvec3& cross) {
  const glm::vec3 normal = unit_normal(t[0], t[1], t[2]);
  using Long = long double;
  const Long size = std::sqrt(Long(cross.x) * cross.x + Long(cross.y) * cross.y + Long(cross.z) * cross.z);
  for (int i = 0; i < 3; ++i) {
    const Long truth = size > 0 ? cross[i] / size : 0;
    const Long last = std::ldexp(Long(1), truth != 0 ? std::max(std::ilogb(truth) - 23, -149) : -149);
    EXPECT_LE(std::abs(normal[i] - truth), 0.5L * last + std::abs(truth) * 0x1p-42L) << i;
  }
}

void expect_right(const Triangle& t) {
  const glm::dvec3 cross = exact_cross(t[0], t[1], t[2]);
  expect_unit_normal(t, cross);
  bool flat = true;
  for (int i = 0; i < 3; ++i) {
    const Dyadic truth = component(t, i);
    flat = flat && truth.sign() == 0;
    if (truth.sign() == 0)
      EXPECT_EQ(cross[i], 0);
    else
      EXPECT_NEAR(cross[i] / quotient(truth, Dyadic(1.f)), 1, 1e-15);
  }
  EXPECT_EQ(has_no_area(t[0], t[1], t[2]), flat);
  EXPECT_EQ(has_area(t), !flat);
}

// Numbers of every size, so that differences round in double; lines through points that are exact.
TEST(ExactArea, IsThatOfIntegers) {
  std::mt19937 random(5);
  std::uniform_int_distribution<int> exponent(-149, 40), small(-9, 9);
  std::uniform_real_distribution<float> unit(-1, 1);
  const auto any = [&] { return std::ldexp(unit(random), exponent(random)); };
  const auto integer = [&] { return glm::vec3(small(random), small(random), small(random)); };
  for (int i = 0; i < 20000; ++i) {
    expect_right({{{any(), any(), any()}, {any(), any(), any()}, {any(), any(), any()}}});
    const glm::vec3 p = integer(), d = integer();
    expect_right({{p, p + d * float(small(random)), p + d * float(small(random))}});
    const glm::vec3 far(unit(random), unit(random), unit(random));
    expect_right({{far, -2.0f * far, {any(), any(), any()}}});  // a line through zero, and a point that may be near it
  }
}

TEST(ExactArea, NeedlesOfAnyWidthHaveOne) {
  for (const float width : {1.f, 1e-8f, 1e-17f, 1e-30f, 1e-44f, 1.401298e-45f}) {
    const Triangle needle{{{-1e3f, -1e3f, 0}, {1e3f, 1e3f, 0}, {width, 0, 0}}};
    expect_right(needle);
    EXPECT_FALSE(is_degenerate(needle)) << width;
    const glm::vec3 normal = geometric_normal(needle);
    EXPECT_EQ(std::abs(normal.z), 1) << width;
  }
  EXPECT_TRUE(is_degenerate({{{-1e3f, -1e3f, 0}, {1e3f, 1e3f, 0}, {0, 0, 0}}}));
  EXPECT_TRUE(is_degenerate({{{1, 2, 3}, {1, 2, 3}, {4, 5, 6}}}));
  EXPECT_TRUE(is_degenerate({{{0, -0.0f, 0}, {-0.0f, 0, 0}, {4, 5, 6}}}));
}

}  // namespace
}  // namespace ballot
