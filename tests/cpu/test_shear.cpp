// Tests the power of two that keeps the products of the watertight test in range.
#include <gtest/gtest.h>

#include <bit>
#include <cmath>

#include "engine/tree/device/shear.h"
#include "engine/tree/host/bvh.h"

namespace ballot {
namespace {

Bounds cube(float at, float side) { return {glm::vec3(at), glm::vec3(at + side)}; }

// Returns the exponent that shaders/lib/numeric/triangle_watertight.glsl uses for a ray that starts at this distance
// from the origin of the boxes.
int own_exponent(float reach) { return 314 - int(std::bit_cast<std::uint32_t>(reach) >> 23); }

TEST(Shear, BringsTheSceneTo55Bits) {
  for (int e = -70; e <= 120; ++e)
    for (const float side : {1.0f, 1.3f, 1.99f}) {
      const Bounds scene = cube(0, std::ldexp(side, e));
      const float scaled = scene.hi.x * shear_scale(scene).scale;
      EXPECT_GE(scaled, 0x1p55f) << e;
      EXPECT_LT(scaled, 0x1p56f) << e;
    }
}

TEST(Shear, DistancesStayBelow2To62) {
  for (int e = -120; e <= 100; e += 5)
    for (const float sides_off : {0.0f, -15.9f, 15.9f, 16.1f, 1e6f}) {
      const float side = std::ldexp(1.3f, e);
      const Bounds scene = cube(sides_off * side, side);
      const ShearScale s = shear_scale(scene);
      const glm::dvec3 origin = box_origin(scene), lo = glm::dvec3(scene.lo) - origin,
                       hi = glm::dvec3(scene.hi) - origin;
      const double off = std::max(std::abs(lo.x), std::abs(hi.x));
      EXPECT_LT((off + double(s.near)) * s.scale, 0x1p62) << e << " " << sides_off;
      for (float reach = std::nextafter(s.near, INFINITY); reach < 1e38f; reach *= 1.7f) {
        const int exponent = own_exponent(reach);
        ASSERT_TRUE(exponent >= 1 && exponent <= 254) << e << " " << reach;
        EXPECT_LT((off + double(reach)) * std::ldexp(1.0, exponent - 127), 0x1p62)
            << e << " " << sides_off << " " << reach;
      }
    }
}

TEST(Shear, CoordinatesStayInRange) {
  for (const float at : {0.0f, 1.0f, 1e10f, 2e38f})
    for (const glm::vec3 sides :
         {glm::vec3(0), glm::vec3(0, 1e-30f, 1e-30f), glm::vec3(1e-40f), glm::vec3(1e38f, 1, 0)}) {
      const Bounds scene{glm::vec3(at, 0, 0) - sides * 0.5f, glm::vec3(at, 0, 0) + sides * 0.5f};
      const ShearScale s = shear_scale(scene);
      EXPECT_TRUE(std::isnormal(s.scale) && std::isnormal(s.near)) << at;
      EXPECT_TRUE(std::isfinite(scene.lo.x * s.scale) && std::isfinite(scene.hi.x * s.scale)) << at;
    }
}

}  // namespace
}  // namespace ballot
