// Tests the error figures of hand-made answers.
#include <gtest/gtest.h>

#include <functional>

#include "engine/core/error.h"
#include "engine/oracle/errors.h"
#include "tests/cpu/exact_cases.h"

namespace ballot {
namespace {

using shapes::Triangles;

constexpr Hit kMiss{0, NO_HIT, 0, 0};
constexpr Arithmetic kArithmetics[] = {Arithmetic::Woop, Arithmetic::MoellerTrumbore, Arithmetic::Exact,
                                       Arithmetic::WoopInDouble};
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

// Prims 0 and 1 share an edge at z = 1. Prim 2 is a twin of 0, prim 3 lies 2 ulp behind them, and prim 4 far behind.
class ErrorsOfAnswers : public testing::Test {
 protected:
  static Triangles make() {
    const float behind = 1 - 0x1p-23f;
    return {{{{0, 0, 1}, {2, 0, 1}, {0, 2, 1}}},
            {{{2, 0, 1}, {2, 2, 1}, {0, 2, 1}}},
            {{{0, 0, 1}, {2, 0, 1}, {0, 2, 1}}},
            {{{0, 0, behind}, {2, 0, behind}, {0, 2, behind}}},
            {{{-9, -9, 0}, {9, -9, 0}, {0, 9, 0}}}};
  }
  ErrorFigures figures(const std::vector<Ray>& rays, const std::vector<Hit>& answers, Want want = Want::Nearest,
                       Arithmetic arithmetic = Arithmetic::Woop, std::size_t max_cases = 8) const {
    return error_figures(exact_, bound_, rays, answers, exact_.nearest(rays), want, arithmetic, max_cases);
  }
  static Hit hit(const ExactHit& h) {
    return {static_cast<float>(h.t), h.prim, static_cast<float>(h.u), static_cast<float>(h.v)};
  }
  Hit hit(const Ray& ray, std::uint32_t prim) const { return hit(exact_.hit(ray, prim)); }

  Triangles triangles_ = make();
  PairTree device_ = encode_pairs(build_bvh(triangles_), triangles_, NodeLayout::Interleaved);
  ExactOracle exact_{device_};
  Oracle bound_{device_};
  Ray inside_{{0.5f, 0.25f, 2}, 0, {0, 0, -1}, 10};
  Ray on_edge_{{1.5f, 0.5f, 2}, 0, {0, 0, -1}, 10};
  Ray beside_{{100, 0, 2}, 0, {0, 0, -1}, 10};
  Ray dead_{{0.5f, 0.25f, 2}, 0, {0, 0, 0}, 10};
};

TEST_F(ErrorsOfAnswers, RightAnswersHaveNone) {
  const std::vector<Ray> rays{inside_, on_edge_, beside_, dead_};
  std::vector<Hit> answers;
  for (const Ray& ray : rays) answers.push_back(hit(exact_.nearest(ray)));
  for (const Want want : {Want::Nearest, Want::Any})
    for (const Arithmetic arithmetic : kArithmetics) {
      const ErrorFigures f = figures(rays, answers, want, arithmetic);
      EXPECT_EQ(f.rays, 4u);
      EXPECT_EQ(f.errors() + f.ties + f.within_bound + f.beyond_bound, 0u);
      EXPECT_EQ(f.t_ulp.max, 0);
      EXPECT_TRUE(f.cases.empty());
    }
}

TEST_F(ErrorsOfAnswers, RaysBeyondTheRangeAreAClassOfTheirOwn) {
  const auto expect_class = [&](const Ray& ray, const Hit& answer, Arithmetic arithmetic, std::uint64_t beyond,
                                std::uint64_t wrong) {
    const ErrorFigures f = figures({ray}, {answer}, Want::Nearest, arithmetic);
    EXPECT_EQ(f.beyond_range, beyond) << ray.origin.z << ' ' << ray.dir.z;
    EXPECT_EQ(f.errors(), wrong) << ray.origin.z << ' ' << ray.dir.z;
  };
  const Ray tiny{{0.5f, 0.25f, 2}, 0, {0, 0, -1.17e-38f}, 10}, least{{0.5f, 0.25f, 2}, 0, {0, 0, -0x1p-126f}, 1e38f};
  const Ray far{{0.5f, 0.25f, 3e7f}, 0, {0, 0, -1}, 1e9f}, near{{0.5f, 0.25f, 2e7f}, 0, {0, 0, -1}, 1e9f};
  for (const Arithmetic arithmetic : kArithmetics) {
    const std::uint64_t exact = arithmetic == Arithmetic::Exact || arithmetic == Arithmetic::WoopInDouble ? 1 : 0;
    expect_class(tiny, kMiss, arithmetic, 1, 0);  // dead in every mode
    expect_class(tiny, hit(inside_, 0), arithmetic, 0, 1);
    expect_class(dead_, kMiss, arithmetic, 0, 0);
    expect_class(least, kMiss, arithmetic, 0, 1);
    expect_class(near, kMiss, arithmetic, 0, 1);
    expect_class(far, kMiss, arithmetic, 1 - exact, exact);
    expect_class(far, hit(far, 0), arithmetic, 0, 0);
  }
}

TEST_F(ErrorsOfAnswers, EachKindIsCounted) {
  const std::vector<Ray> rays{inside_, beside_, inside_, inside_, dead_};
  const ErrorFigures f = figures(rays, {kMiss, hit(inside_, 4), hit(inside_, 4), {1, 99, 0, 0}, hit(inside_, 0)});
  EXPECT_EQ(f.false_misses, 1u);
  EXPECT_EQ(f.false_hits, 2u);
  EXPECT_EQ(f.wrong_prims, 2u);
  EXPECT_EQ(f.wrong_values + f.ties + f.within_bound, 0u);
  EXPECT_EQ(f.beyond_bound, 5u);
  ASSERT_EQ(f.cases.size(), 5u);
  EXPECT_NE(f.cases[0].reason.find("the ray passes 0.25 inside edge 0-1 of prim 0"), std::string::npos)
      << f.cases[0].reason;
  EXPECT_NE(f.cases[1].reason.find("outside edge"), std::string::npos) << f.cases[1].reason;
  EXPECT_NE(f.cases[2].reason.find("prims 0 and 4 lie 8.4e+06 ulp of t apart, prim 4 behind"), std::string::npos)
      << f.cases[2].reason;
  EXPECT_NE(f.cases[3].reason.find("no leaf of the hierarchy holds prim 99"), std::string::npos) << f.cases[3].reason;
  EXPECT_NE(f.cases[4].reason.find("dead"), std::string::npos) << f.cases[4].reason;
  EXPECT_NE(in_words(f.cases[1]).find("ray 1 (100 0 2, t_min 0"), std::string::npos) << in_words(f.cases[1]);
  EXPECT_EQ(figures(rays, {kMiss, kMiss, kMiss, kMiss, kMiss}, Want::Nearest, Arithmetic::Woop, 2).cases.size(), 2u);
}

TEST_F(ErrorsOfAnswers, EqualTIsATieAndSmallerIsNot) {
  const ErrorFigures twin = figures({inside_, on_edge_}, {hit(inside_, 2), hit(on_edge_, 1)});
  EXPECT_EQ(twin.ties, 2u);
  EXPECT_EQ(twin.errors(), 0u);
  // 2 ulp of t behind is wrong, however little it is. The error bound of float32 covers it, that of float64 does not;
  // exact arithmetic has no bound.
  for (const Arithmetic arithmetic : {Arithmetic::Woop, Arithmetic::Exact, Arithmetic::WoopInDouble}) {
    const ErrorFigures behind = figures({inside_}, {hit(inside_, 3)}, Want::Nearest, arithmetic);
    EXPECT_EQ(behind.wrong_prims, 1u);
    EXPECT_EQ(behind.within_bound, arithmetic == Arithmetic::Woop ? 1u : 0u);
    EXPECT_EQ(behind.beyond_bound, arithmetic == Arithmetic::Woop ? 0u : 1u);
    EXPECT_NE(behind.cases.at(0).reason.find("prims 0 and 3 lie 1 ulp of t apart"), std::string::npos)
        << behind.cases[0].reason;
  }
}

// Triangles of one plane lie at the same t but for rounding: whichever is named is right within the bound.
TEST_F(ErrorsOfAnswers, TrianglesOfOnePlaneAreWithinTheBoundOfDouble) {
  const Triangles plane = shapes::coplanar(100);
  const PairTree tree = encode_pairs(build_bvh(plane), plane, NodeLayout::Interleaved);
  const ExactOracle exact(tree);
  const Oracle bound(tree);
  std::size_t others = 0;
  for (const Ray& ray : shapes::random_rays(300)) {
    const ExactHit truth = exact.nearest(ray);
    for (std::uint32_t prim = 0; prim < plane.size() && truth.prim != NO_HIT; ++prim) {
      const ExactHit own = exact.hit(ray, prim);
      if (own.prim == NO_HIT || own.prim == truth.prim || std::abs(own.t - truth.t) > 1e-16) continue;
      EXPECT_EQ(bound.judge(ray, hit(own), truth, Want::Nearest, Arithmetic::WoopInDouble), Verdict::Tie) << prim;
      ++others;
    }
  }
  EXPECT_GT(others, 10u);
}

TEST_F(ErrorsOfAnswers, WithinTheBoundAtAnEdge) {
  // Both rays pass close to edge 2-0 of prim 0, an outer edge at x = 0: one at 1e-9 outside, the other at 1e-9 inside.
  const Ray beside{{-1e-9f, 0.25f, 2}, 0, {0, 0, -1}, 1.5f};
  const Ray within{{1e-9f, 0.25f, 2}, 0, {0, 0, -1}, 1.5f};
  EXPECT_EQ(exact_.nearest(beside).prim, NO_HIT);
  EXPECT_EQ(exact_.nearest(within).prim, 0u);
  const std::vector<Hit> answers{{1, 0, 0, 0.125f}, kMiss};
  const ErrorFigures woop = figures({beside, within}, answers);
  EXPECT_EQ(woop.false_hits, 1u);
  EXPECT_EQ(woop.false_misses, 1u);
  EXPECT_EQ(woop.within_bound, 2u);
  EXPECT_NE(woop.cases.at(0).reason.find("1e-09 outside edge 2-0 of prim 0, 0.0"), std::string::npos)
      << woop.cases[0].reason;
  EXPECT_NE(woop.cases.at(1).reason.find("1e-09 inside edge 2-0 of prim 0, 0.0"), std::string::npos)
      << woop.cases[1].reason;
  const ErrorFigures exact = figures({beside, within}, answers, Want::Nearest, Arithmetic::Exact);
  EXPECT_EQ(exact.within_bound, 0u);
  EXPECT_EQ(exact.beyond_bound, 2u);
  EXPECT_EQ(exact.cases.at(0).reason.find("float32"), std::string::npos) << exact.cases[0].reason;
  const ErrorFigures in_double = figures({beside, within}, answers, Want::Nearest, Arithmetic::WoopInDouble);
  EXPECT_EQ(in_double.beyond_bound, 2u);
  EXPECT_NE(in_double.cases.at(0).reason.find("of what float64 may move it"), std::string::npos);
  const Ray nearer{{-1e-17f, 0.25f, 2}, 0, {0, 0, -1}, 1.5f};
  EXPECT_EQ(figures({nearer}, {answers[0]}, Want::Nearest, Arithmetic::WoopInDouble).within_bound, 1u);
}

TEST_F(ErrorsOfAnswers, ValuesOfTheRightPrim) {
  const Hit right = hit(inside_, 0);
  const auto changed = [&](const std::function<void(Hit&)>& change) {
    Hit h = right;
    change(h);
    return h;
  };
  const float next = std::nextafter(1.f, 2.f);
  const std::vector<Hit> wrong{changed([](Hit& h) { h.t = kNan; }),  changed([](Hit& h) { h.u = kNan; }),
                               changed([](Hit& h) { h.v = kNan; }),  changed([](Hit& h) { h.t = 1.001f; }),
                               changed([](Hit& h) { h.u = 0.26f; }), changed([](Hit& h) { h.v = 0.5f; })};
  for (const Arithmetic arithmetic : kArithmetics) {
    const ErrorFigures f = figures(std::vector<Ray>(6, inside_), wrong, Want::Nearest, arithmetic);
    EXPECT_EQ(f.wrong_values, 6u);
    EXPECT_EQ(f.errors(), 6u);
    EXPECT_EQ(f.within_bound + f.beyond_bound, 0u);
  }
  Ray ends = inside_;
  ends.t_max = 1;  // the exact t
  const std::vector<Hit> late{changed([&](Hit& h) { h.t = next; })};
  EXPECT_EQ(figures({ends}, late).wrong_values, 1u);
  EXPECT_NE(figures({ends}, late).cases.at(0).reason.find("1 ulp beyond t_max 1"), std::string::npos);
  EXPECT_EQ(figures({inside_}, late).wrong_values, 0u);
  EXPECT_EQ(figures({inside_}, late, Want::Nearest, Arithmetic::Exact).wrong_values, 0u);
}

TEST_F(ErrorsOfAnswers, UlpsOfT) {
  std::vector<Hit> answers(100, hit(inside_, 0));
  for (std::size_t i = 0; i < 60; ++i) answers[i].t = 1 + 0x1p-23f;
  answers[7].t = 1 + 0x1p-21f;
  answers[8].t = 1 - 0x1p-24f;  // half an ulp of 1
  answers[9].t = kNan;
  const ErrorFigures f = figures(std::vector<Ray>(100, inside_), answers);
  EXPECT_EQ(f.t_ulp.median, 1);
  EXPECT_EQ(f.t_ulp.p99, 1);
  EXPECT_EQ(f.t_ulp.max, 4);
}

TEST_F(ErrorsOfAnswers, AnyTriangleThatIsHitIsRight) {
  const std::vector<Ray> rays{inside_, inside_, inside_, inside_, beside_};
  const ErrorFigures f =
      figures(rays, {hit(inside_, 4), hit(inside_, 3), {1, 1, 0.2f, 0.2f}, kMiss, {1, 0, 0, 0}}, Want::Any);
  EXPECT_EQ(f.wrong_prims, 1u);  // prim 1 lies beside the ray
  EXPECT_EQ(f.false_misses, 1u);
  EXPECT_EQ(f.false_hits, 1u);
  EXPECT_EQ(f.errors(), 3u);
  EXPECT_EQ(f.ties, 0u);
  EXPECT_EQ(f.t_ulp.max, 0);
  Hit off = hit(inside_, 4);
  off.t = 2.5f;
  EXPECT_EQ(figures({inside_}, {off}, Want::Any).wrong_values, 1u);
}

TEST_F(ErrorsOfAnswers, SizesMustAgree) {
  EXPECT_THROW(figures({inside_, inside_}, {kMiss}), Error);
  EXPECT_EQ(figures({}, {}).rays, 0u);
}

TEST_F(ErrorsOfAnswers, TheJudgeAllowsExactArithmeticNothing) {
  const OracleHit truth = bound_.nearest(inside_);
  EXPECT_EQ(bound_.judge(inside_, hit(inside_, 0), truth, Want::Nearest, Arithmetic::Exact), Verdict::Same);
  EXPECT_EQ(bound_.judge(inside_, hit(inside_, 3), truth, Want::Nearest, Arithmetic::Exact), Verdict::WrongPrim);
  EXPECT_EQ(bound_.judge(inside_, hit(inside_, 3), truth, Want::Any, Arithmetic::Exact), Verdict::Same);
  EXPECT_EQ(bound_.judge(inside_, kMiss, truth, Want::Nearest, Arithmetic::Exact), Verdict::FalseMiss);
  EXPECT_EQ(bound_.judge(beside_, hit(inside_, 0), {}, Want::Nearest, Arithmetic::Exact), Verdict::FalseHit);
  EXPECT_THROW(bound_.allowance(inside_, 99, Arithmetic::Woop), Error);
}

}  // namespace
}  // namespace ballot
