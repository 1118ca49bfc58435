// Tests the exact oracle of shapes: against brute force in long double, where integers alone can tell, and its filter
// against its integers.
#include <gtest/gtest.h>

#include "engine/oracle/exact.h"
#include "engine/oracle/shape_sight.h"
#include "tests/cpu/shape_truth.h"

namespace ballot {
namespace {

using namespace test;
constexpr ShapeKind kAll[] = {ShapeKind::Spheres, ShapeKind::Discs, ShapeKind::Capsules, ShapeKind::Boxes};
constexpr float kFar = 1e4f;

Ray ray_at(const Shape& s, shapes::Random& random, std::size_t i) {
  const glm::vec3 from = random.point(i % 4 == 0 ? 1.f : 4.f), middle = 0.5f * glm::vec3(s.a + s.b);
  const glm::vec3 to = (i % 2 ? glm::vec3(s.a) : middle) + random.point(0.3f);
  return {from, -kFar, (to - from) * random.in(0.01f, 10), kFar};
}

struct Seen {
  bool met = false;
  double t[2] = {0, 0};
};
Seen see(const Ray& ray, ShapeKind kind, const Shape& s) {
  ShapeSight sight(ray, kind, s);
  Seen seen{sight.meets()};
  for (int end = 0; seen.met && end < sight.ends(); ++end) {
    seen.t[end] = sight.number(end);
    EXPECT_LE(sight.t(end).low, seen.t[end]);
    EXPECT_GE(sight.t(end).high, seen.t[end]);
  }
  return seen;
}

TEST(ExactShapes, HoldToLongDouble) {
  for (const ShapeKind kind : {ShapeKind::Spheres, ShapeKind::Capsules, ShapeKind::Boxes}) {
    shapes::Random random(5);
    const std::vector<Shape> all = random_shapes(kind, 400, 0.3f, 21);
    std::size_t met = 0;
    for (std::size_t i = 0; i < all.size(); ++i) {
      SCOPED_TRACE(fmt::format("{} {}", info_of(kind).name, i));
      const Ray ray = ray_at(all[i], random, i);
      const Seen seen = see(ray, kind, all[i]);
      const Number unit = length(vector(ray.dir)), reach = 8 / unit;
      const Number least = deepest(kind, all[i], ray, -reach, reach).value;
      ASSERT_EQ(seen.met, least < 1e-15L) << double(least);  // a flat box has no point within
      if (!seen.met) continue;
      ++met;
      for (const double t : seen.t) {
        EXPECT_LE(std::abs(deepest(kind, all[i], ray, t, t).value), 8 * 0x1p-23L);
        EXPECT_LE(std::abs(float(t) - t), std::abs(t) * 0x1p-24);
      }
      // Just beyond either end the line is outside.
      const Number off = 1e-5L / unit;
      EXPECT_GT(deepest(kind, all[i], ray, seen.t[0] - off, seen.t[0] - off).value, 0);
      EXPECT_GT(deepest(kind, all[i], ray, seen.t[1] + off, seen.t[1] + off).value, 0);
    }
    EXPECT_GT(met, 100u);
  }
}

/// Expects that what Bounded decides is what Dyadic decides.
template <class Ends>
void expect_alike(const std::optional<bool>& rough, const std::optional<bool>& exact, const ShapeEnds<Bounded>& a,
                  const Ends& b, std::size_t& decided) {
  ASSERT_TRUE(exact);
  if (!rough) return;
  ++decided;
  ASSERT_EQ(*rough, *exact);
  if (!*exact) return;
  for (int end = 0; end < 2; ++end) {
    const auto value = [&](const Bounded& x, const Dyadic& y) {
      const double z = quotient(y, Dyadic(1.f));
      EXPECT_LE(std::abs(x.value - z), x.error + std::abs(z) * 0x1p-52);
    };
    value(a.at[end].p, b.at[end].p);
    value(a.at[end].q, b.at[end].q);
    value(a.at[end].r, b.at[end].r);
    EXPECT_EQ(a.at[end].s, b.at[end].s);
    EXPECT_EQ(a.part[end], b.part[end]);
  }
}

TEST(ExactShapes, FilterAgreesWithIntegers) {
  for (const float scale : {1.f, 1e-12f, 1e9f})
    for (const ShapeKind kind : kAll) {
      shapes::Random random(6);
      std::vector<Shape> all = random_shapes(kind, 300, 0.3f, 22);
      std::size_t decided = 0;
      for (std::size_t i = 0; i < all.size(); ++i) {
        SCOPED_TRACE(fmt::format("{} {} of scale {}", info_of(kind).name, i, scale));
        Ray ray = ray_at(all[i], random, i);
        ray.origin *= scale;
        all[i].a *= scale;
        if (kind != ShapeKind::Discs) all[i].b *= scale;
        if (i % 5 == 0) ray.dir.y = 0;  // so that some numbers are equal or zero
        if (i % 10 == 0) ray.origin = glm::vec3(all[i].a), ray.dir.z = 0;
        ShapeEnds<Bounded> rough;
        ShapeEnds<Dyadic> exact;
        const std::optional<bool> met = meet_shape(ray, kind, all[i], rough);
        expect_alike(met, meet_shape(ray, kind, all[i], exact), rough, exact, decided);
      }
      EXPECT_GT(decided, 200u) << info_of(kind).name << " of scale " << scale;
    }
}

float up(float x) { return std::nextafter(x, INFINITY); }
float down(float x) { return std::nextafter(x, -INFINITY); }

// What no rounding may blur: tangents, ends of ranges, far and small spheres.
TEST(ExactShapes, DecidesWhereRoundingCannot) {
  const auto met = [](ShapeKind kind, const Shape& s, glm::vec3 from, glm::vec3 dir) {
    return see({from, 0, dir, kFar}, kind, s).met;
  };
  const Shape ball{{0, 0, 0, 5}, {}};
  EXPECT_TRUE(met(ShapeKind::Spheres, ball, {3, 4, -9}, {0, 0, 1}));
  EXPECT_FALSE(met(ShapeKind::Spheres, ball, {3, up(4), -9}, {0, 0, 1}));
  EXPECT_TRUE(met(ShapeKind::Spheres, ball, {3, down(4), -9}, {0, 0, 1e-30f}));
  const Shape speck{{1000, 2000, 3000, 1e-30f}, {}};
  EXPECT_TRUE(met(ShapeKind::Spheres, speck, {0, 0, 0}, {1, 2, 3}));
  EXPECT_FALSE(met(ShapeKind::Spheres, speck, {0, 0, 0}, {1, 2, up(3)}));
  const Shape rod{{0, 0, 0, 5}, {0, 0, 8, 5}}, cone{{0, 0, 0, 5}, {0, 0, 8, 0}};
  EXPECT_TRUE(met(ShapeKind::Capsules, rod, {3, 4, -9}, {0, 0, 1}));
  EXPECT_TRUE(met(ShapeKind::Capsules, rod, {-9, 5, 4}, {1, 0, 0}));
  EXPECT_FALSE(met(ShapeKind::Capsules, rod, {-9, up(5), 4}, {1, 0, 0}));
  EXPECT_TRUE(met(ShapeKind::Capsules, cone, {-9, 0, 8}, {1, 0, 0}));  // its tip
  EXPECT_FALSE(met(ShapeKind::Capsules, cone, {-9, 0, up(8)}, {1, 0, 0}));
  EXPECT_FALSE(met(ShapeKind::Capsules, {{0, 0, 0, 0}, {1, 0, 0, 0}}, {0, 0, -1}, {0, 0, 1}));
  const Shape disc{{0, 0, 0, 5}, {0, 0, 1, 0}}, box{{-1, -1, 2, 0}, {1, 1, 2, 0}};
  EXPECT_TRUE(met(ShapeKind::Discs, disc, {3, 4, -9}, {0, 0, 3}));
  EXPECT_FALSE(met(ShapeKind::Discs, disc, {up(3), 4, -9}, {0, 0, 3}));
  EXPECT_FALSE(met(ShapeKind::Discs, disc, {-9, 0, 0}, {1, 0, 0}));
  EXPECT_TRUE(met(ShapeKind::Boxes, box, {-9, 1, 2}, {1, 0, 0}));
  EXPECT_FALSE(met(ShapeKind::Boxes, box, {-9, up(1), 2}, {1, 0, 0}));
  for (const float t_min : {4.f, up(4)}) {
    const Ray ray{{0, 0, -9}, t_min, {0, 0, 1}, kFar};
    ShapeSight sight(ray, ShapeKind::Spheres, ball);
    EXPECT_EQ(sight.meets() && sight.within(0), t_min == 4);
    EXPECT_TRUE(sight.within(1));
  }
}

// t of one surface, seen as that of two shapes, is the same, and what differs in the last bits is told apart.
TEST(ExactShapes, OrdersRoots) {
  const Shape ball{{1, 2, 3, 0.7f}, {}}, rod{{1, 2, 3, 0.7f}, {4, 5, 9, 0.7f}}, larger{{1, 2, 3, up(0.7f)}, {}};
  const Shape pair{{1, 2, 3, 0.7f}, {1, 2, 3, 0.1f}};
  const Ray ray{{0.3f, 0.1f, -4.7f}, 0, {0.1f, 0.23f, 0.83f}, kFar};
  const auto order = [&](ShapeKind kind, const Shape& a, ShapeKind other, const Shape& b, int end) {
    ShapeSight first(ray, kind, a), second(ray, other, b);
    EXPECT_TRUE(first.meets() && second.meets());
    return ShapeSight::compare_t(first, end, second, end);
  };
  for (const int end : {0, 1}) {
    EXPECT_EQ(order(ShapeKind::Spheres, ball, ShapeKind::Capsules, pair, end), std::strong_ordering::equal);
    EXPECT_EQ(order(ShapeKind::Spheres, ball, ShapeKind::Spheres, larger, end),
              end == 0 ? std::strong_ordering::greater : std::strong_ordering::less);
  }
  EXPECT_EQ(order(ShapeKind::Spheres, ball, ShapeKind::Capsules, rod, 0), std::strong_ordering::equal);
  EXPECT_EQ(order(ShapeKind::Spheres, ball, ShapeKind::Capsules, rod, 1), std::strong_ordering::less);
}

// Discs lie in the boxes that stand in for them, to the last bit of a normal.
TEST(ExactShapes, BoundsHoldDiscs) {
  shapes::Random random(8);
  for (int i = 0; i < 20000; ++i) {
    const glm::vec3 small = random.point(1) * std::exp2(float(-(i % 24)));
    const glm::vec3 n = glm::normalize(glm::vec3(small.x, small.y, 1));
    const Shape disc{{0.3f, 0.1f, -0.2f, 1}, {n, 0}};
    const Bounds b = bounds_of(ShapeKind::Discs, disc);
    const Vector v = vector(n);
    const Number all = product(v, v);
    for (std::size_t k = 0; k < 3; ++k) {
      const Number reach = std::sqrt((all - v[k] * v[k]) / all);
      ASSERT_LE(b.lo[int(k)], disc.a[int(k)] - reach) << i;
      ASSERT_GE(b.hi[int(k)], disc.a[int(k)] + reach) << i;
    }
  }
}

}  // namespace
}  // namespace ballot
