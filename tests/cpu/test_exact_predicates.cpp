// Compares the exact predicates and the filter with a naive solution of the linear system in rational numbers.
#include <gtest/gtest.h>

#include <boost/multiprecision/cpp_int.hpp>
#include <limits>
#include <optional>

#include "engine/oracle/filter.h"
#include "engine/oracle/oracle.h"
#include "engine/oracle/predicates.h"
#include "tests/cpu/exact_cases.h"

namespace ballot {
namespace {

using Rational = boost::multiprecision::cpp_rational;
using exact_cases::awkward;
using exact_cases::awkward_point;

Rational exactly(double x) {
  int exponent = 0;
  const auto mantissa = static_cast<std::int64_t>(std::ldexp(std::frexp(x, &exponent), 53));
  const boost::multiprecision::cpp_int one = 1;
  const int shift = exponent - 53;
  return shift >= 0 ? Rational(mantissa * (one << shift)) : Rational(mantissa, one << -shift);
}

struct Vec {
  explicit Vec(const glm::vec3& v) : at{exactly(v.x), exactly(v.y), exactly(v.z)} {}
  Vec operator-(const Vec& b) const {
    Vec out = *this;
    for (int k = 0; k < 3; ++k) out.at[k] -= b.at[k];
    return out;
  }
  Rational at[3];
};

Rational determinant(const Vec& a, const Vec& b, const Vec& c) {
  return a.at[0] * (b.at[1] * c.at[2] - b.at[2] * c.at[1]) - b.at[0] * (a.at[1] * c.at[2] - a.at[2] * c.at[1]) +
         c.at[0] * (a.at[1] * b.at[2] - a.at[2] * b.at[1]);
}

// Solves o + t d = v0 + u (v1 - v0) + v (v2 - v0) by Cramer's rule. Returns nothing if the ray is parallel to the
// plane.
struct Solution {
  Rational t, u, v;
  bool inside() const { return u >= 0 && v >= 0 && u + v <= 1; }
};

std::optional<Solution> solve(const Ray& ray, const Triangle& triangle) {
  const Vec v0(triangle[0]), e1 = Vec(triangle[1]) - v0, e2 = Vec(triangle[2]) - v0;
  const Vec b = v0 - Vec(ray.origin), d(ray.dir);
  const Rational whole = determinant(d, e1, e2);  // t d - u e1 - v e2 = b
  if (whole == 0) return std::nullopt;
  return Solution{determinant(b, e1, e2) / whole, -determinant(d, b, e2) / whole, -determinant(d, e1, b) / whole};
}

// True if the double lies within one ulp of the exact number.
bool is_rounded(double found, const Rational& exact) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (!std::isfinite(found) || std::abs(found) < 1e-300) return true;  // outside of the range that a hit may have
  return exactly(std::nextafter(found, -kInfinity)) < exact && exact < exactly(std::nextafter(found, kInfinity));
}

bool holds(const Interval& t, const Rational& exact) {
  return (std::isinf(t.low) || exactly(t.low) <= exact) && (std::isinf(t.high) || exact <= exactly(t.high));
}

struct Tally {
  int hits = 0, surely = 0, cases = 0;
};

void check(const Ray& ray, const Triangle& triangle, Tally& tally) {
  const std::optional<Solution> truth = solve(ray, triangle);
  const ExactSight sight(ray, triangle);
  const bool hit = truth && truth->inside();
  ASSERT_EQ(sight.det.sign() != 0, truth.has_value());
  ASSERT_EQ(sight.hits_line(), hit);
  const FilterRay filter_ray(ray);
  const FilterSight filter(filter_ray, triangle);
  ASSERT_NE(filter.hits_line(), hit ? Sure::No : Sure::Yes);
  ++tally.cases;
  tally.surely += filter.hits_line() != Sure::Unsure ? 1 : 0;
  if (!truth) {
    ASSERT_TRUE(std::isinf(filter.t_bounds().low) && std::isinf(filter.t_bounds().high));
    return;
  }
  ASSERT_TRUE(holds(filter.t_bounds(), truth->t)) << truth->t;
  ASSERT_EQ(sight.within(ray), truth->t >= exactly(ray.t_min) && truth->t <= exactly(ray.t_max));
  if (!hit) return;
  ++tally.hits;
  ASSERT_TRUE(is_rounded(sight.t(), truth->t));
  ASSERT_TRUE(is_rounded(sight.weight(1), truth->u));
  ASSERT_TRUE(is_rounded(sight.weight(2), truth->v));
}

TEST(ExactPredicates, AgreeWithRationalsOnOrdinaryInput) {
  shapes::Random random(21);
  Tally tally;
  for (int i = 0; i < 2000 && !HasFatalFailure(); ++i) {
    const Triangle t{random.point(1), random.point(1), random.point(1)};
    check(exact_cases::ray_at(t, random), t, tally);
  }
  EXPECT_GT(tally.hits, 300);
  EXPECT_GT(tally.surely, tally.cases / 3);
}

TEST(ExactPredicates, AgreeWithRationalsOnAwkwardInput) {
  shapes::Random random(22);
  Tally tally;
  for (int i = 0; i < 4000 && !HasFatalFailure(); ++i) {
    Triangle t{awkward_point(random), awkward_point(random), awkward_point(random)};
    if (i % 10 == 0) t[2] = t[0];
    const Ray ray{awkward_point(random), awkward(random), awkward_point(random), awkward(random)};
    if (!is_dead(ray)) check(ray, t, tally);
  }
  EXPECT_GT(tally.cases, 1000);
  EXPECT_GT(tally.hits, 20);
}

// With few bits per coordinate, rays often pass exactly through an edge, lie in a plane or meet in a point.
TEST(ExactPredicates, AgreeWithRationalsOnSmallIntegers) {
  shapes::Random random(23);
  Tally tally;
  int parallel = 0, on_edges = 0;
  const auto point = [&] {
    const auto at = [&] { return static_cast<float>(random.below(5)) - 2; };
    const float x = at(), y = at(), z = at();
    return glm::vec3(x, y, z);
  };
  for (int i = 0; i < 6000 && !HasFatalFailure(); ++i) {
    const Triangle t{point(), point(), point()};
    const Ray ray{point(), static_cast<float>(random.below(3)) - 1, point(), static_cast<float>(random.below(3))};
    if (is_dead(ray)) continue;
    check(ray, t, tally);
    const auto truth = solve(ray, t);
    parallel += !truth ? 1 : 0;
    on_edges += truth && truth->inside() && (truth->u == 0 || truth->v == 0 || truth->u + truth->v == 1) ? 1 : 0;
  }
  EXPECT_GT(parallel, 100);
  EXPECT_GT(on_edges, 100);
}

TEST(ExactPredicates, OrderTheTOfTwoTrianglesAsRationalsDo) {
  shapes::Random random(24);
  int equal = 0, compared = 0;
  for (int i = 0; i < 2000; ++i) {
    const bool integers = i % 2 == 0;
    const auto at = [&] { return integers ? static_cast<float>(random.below(4)) : awkward(random); };
    const auto point = [&] {
      const float x = at(), y = at(), z = at();
      return glm::vec3(x, y, z);
    };
    const Triangle a{point(), point(), point()}, b{point(), point(), point()};
    const Ray ray{point(), 0, point(), 1e38f};
    if (is_dead(ray)) continue;
    const auto ta = solve(ray, a), tb = solve(ray, b);
    if (!ta || !tb) continue;
    const ExactSight sa(ray, a), sb(ray, b);
    const auto order = ta->t < tb->t   ? std::strong_ordering::less
                       : ta->t > tb->t ? std::strong_ordering::greater
                                       : std::strong_ordering::equal;
    ASSERT_EQ(compare_t(sa, sb), order);
    ASSERT_TRUE(is_rounded(t_apart(sa, sb), tb->t - ta->t));
    equal += order == 0 ? 1 : 0;
    ++compared;
  }
  EXPECT_GT(compared, 500);
  EXPECT_GT(equal, 20);
}

TEST(Dyadic, SumsProductsAndQuotientsAreExact) {
  shapes::Random random(25);
  for (int i = 0; i < 2000; ++i) {
    const float a = awkward(random), b = awkward(random), c = awkward(random);
    const Dyadic x(a), y(b), z(c);
    const Rational p = exactly(a) * exactly(b) + exactly(c);
    ASSERT_EQ((x * y + z).sign(), p.sign());
    ASSERT_EQ(x * y + z - x * y, z);
    ASSERT_EQ((x <=> y) == 0, a == b);
    ASSERT_TRUE(c == 0 || is_rounded(quotient(x * y + z, z), p / exactly(c)));
  }
  const auto power = [](int n) {
    Dyadic product(1.f);
    for (int i = 0; i < n; ++i) product = product * Dyadic(16777215.f);  // 24 bits
    return product;
  };
  EXPECT_EQ(quotient(power(80), power(79)), 16777215);
  EXPECT_EQ(quotient(power(200), power(199)), 16777215);  // 4800 bits
  EXPECT_EQ(quotient(Dyadic(1e-45f), Dyadic(1e-45f)), 1);
  EXPECT_EQ(quotient(Dyadic(0.f), Dyadic(-3.f)), 0);
  EXPECT_EQ(quotient(Dyadic(-1.f), Dyadic(3.f)), -1.0 / 3);
}

}  // namespace
}  // namespace ballot
