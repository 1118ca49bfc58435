// Tests that the judge accepts the rounding of float32 and finds each kind of wrong answer.
#include <embree3/rtcore.h>
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <utility>

#include "engine/core/error.h"
#include "engine/oracle/oracle.h"
#include "tests/cpu/shapes.h"

namespace ballot {
namespace {

using shapes::Triangles;

constexpr Hit kMiss{0, NO_HIT, 0, 0};

// Woop, Benthin, Wald. Watertight Ray/Triangle Intersection. JCGT 2013, section 2 and appendix, in float32 as in
// the kernels.
class Woop32 {
 public:
  explicit Woop32(const Ray& ray) : ray_(ray) {
    for (int k = 1; k < 3; ++k)
      if (std::abs(ray.dir[k]) > std::abs(ray.dir[kz_])) kz_ = k;
    kx_ = (kz_ + 1) % 3;
    ky_ = (kz_ + 2) % 3;
    sx_ = ray.dir[kx_] / ray.dir[kz_];
    sy_ = ray.dir[ky_] / ray.dir[kz_];
    sz_ = 1.0f / ray.dir[kz_];
  }

  void test(const Triangle& triangle, std::uint32_t prim, Hit& best) const {
    std::array<float, 3> x, y, z;
    for (std::size_t i = 0; i < 3; ++i) {
      const glm::vec3 v = triangle[i] - ray_.origin;
      x[i] = v[kx_] - sx_ * v[kz_];
      y[i] = v[ky_] - sy_ * v[kz_];
      z[i] = sz_ * v[kz_];
    }
    const float a = x[2] * y[1] - y[2] * x[1];
    const float b = x[0] * y[2] - y[0] * x[2];
    const float c = x[1] * y[0] - y[1] * x[0];
    if ((a < 0 || b < 0 || c < 0) && (a > 0 || b > 0 || c > 0)) return;
    const float det = a + b + c;
    if (det == 0) return;
    const float inverse = 1.0f / det;
    const float t = (a * z[0] + b * z[1] + c * z[2]) * inverse;
    if (!(t >= ray_.t_min && t <= ray_.t_max)) return;
    if (best.prim == NO_HIT || t < best.t || (t == best.t && prim < best.prim))
      best = {t, prim, b * inverse, c * inverse};
  }

 private:
  const Ray& ray_;
  int kx_ = 0, ky_ = 0, kz_ = 0;
  float sx_ = 0, sy_ = 0, sz_ = 0;
};

std::vector<Hit> woop32(const Triangles& triangles, const std::vector<Ray>& rays) {
  std::vector<Hit> out;
  for (const Ray& ray : rays) {
    Hit best = kMiss;
    if (!is_dead(ray)) {
      const Woop32 woop(ray);
      for (std::uint32_t prim = 0; prim < triangles.size(); ++prim) woop.test(triangles[prim], prim, best);
    }
    out.push_back(best);
  }
  return out;
}

struct Judged {
  explicit Judged(const Triangles& triangles)
      : device(encode_pairs(build_bvh(triangles), triangles, NodeLayout::Interleaved)), oracle(device) {}
  PairTree device;
  Oracle oracle;
};

// Float32 answers of every kind of ray must pass, and ties must be few.
void expect_accepted(const Triangles& triangles, const std::vector<Ray>& rays, double tie_share,
                     Want want = Want::Nearest) {
  const Judged scene(triangles);
  const Judgement j = scene.oracle.judge(rays, woop32(triangles, rays), scene.oracle.nearest(rays), want);
  EXPECT_EQ(j.rays, rays.size());
  EXPECT_EQ(j.errors(), 0u);
  EXPECT_LE(j.worst_t_error, 1);
  EXPECT_LE(static_cast<double>(j.tie), tie_share * static_cast<double>(j.rays));
  std::printf("  %zu rays: %zu the same, %zu ties, worst t error %.3f of its bound\n", static_cast<std::size_t>(j.rays),
              static_cast<std::size_t>(j.same), static_cast<std::size_t>(j.tie), j.worst_t_error);
  for (const std::string& line : j.examples) ADD_FAILURE() << line;
}

TEST(Judge, AcceptsFloat32OnASoup) {
  const Triangles triangles = shapes::soup(200, 0.3f);
  expect_accepted(triangles, shapes::random_rays(100'000), 1e-4);
  expect_accepted(triangles, shapes::random_rays(10'000), 1e-4, Want::Any);
}

TEST(Judge, AcceptsFloat32AtEdgesOfASphere) {
  const Triangles triangles = shapes::sphere(3);
  expect_accepted(triangles, shapes::edge_rays(triangles, 10'000, {0.1f, 0.2f, 0}), 0.9);
  expect_accepted(triangles, shapes::edge_rays(triangles, 10'000, {100, 20, 50}), 1);
}

TEST(Judge, AcceptsFloat32OnHardRays) {
  for (const Triangles& triangles : {shapes::slivers(200), shapes::grid(10, 0), shapes::same_centroid(200)}) {
    expect_accepted(triangles, shapes::axis_rays(triangles, 2000), 1);
    expect_accepted(triangles, shapes::edge_rays(triangles, 2000, {0.5f, 2, 0.25f}), 1);
  }
  const Triangles triangles = shapes::huge_and_tiny(200);
  expect_accepted(triangles, shapes::random_rays(2000, 1, 1e4f), 0.2);
  expect_accepted(triangles, shapes::random_rays(2000, 2, 0.01f), 0.2);
  expect_accepted(shapes::identical(50), shapes::axis_rays(shapes::identical(50), 500), 1);
  expect_accepted(shapes::identical(50), shapes::dead_rays(), 0);
}

class JudgeErrors : public testing::Test {
 protected:
  // Two unit triangles, one above the other, and a third beside them. The ray hits 0 at t 1 and 1 at t 2.
  Triangles triangles_{{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}},
                       {{{0, 0, -1}, {1, 0, -1}, {0, 1, -1}}},
                       {{{5, 5, 0}, {6, 5, 0}, {5, 6, 0}}},
                       {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}},   // twin of 0
                       {{{0, 0, 0}, {0, 1, 0}, {1, 0, 0}}}};  // the same triangle, vertices in another order
  Judged scene_{triangles_};
  Ray ray_{{0.25f, 0.5f, 1}, 0, {0, 0, -1}, 10};
  Hit right_{1, 0, 0.25f, 0.5f};

  Verdict of(const Hit& answer, Want want = Want::Nearest) const { return of(ray_, answer, want); }
  Verdict of(const Ray& ray, const Hit& answer, Want want = Want::Nearest) const {
    return scene_.oracle.judge(ray, answer, scene_.oracle.nearest(ray), want);
  }
};

TEST_F(JudgeErrors, TheRightAnswerIsTheSame) {
  EXPECT_EQ(of(right_), Verdict::Same);
  EXPECT_EQ(of(right_, Want::Any), Verdict::Same);
  EXPECT_EQ(of({1 + 0x1p-22f, 0, 0.25f, 0.5f}), Verdict::Same);
}

TEST_F(JudgeErrors, WrongDistanceOrWeights) {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(of({1.0001f, 0, 0.25f, 0.5f}), Verdict::WrongT);
  EXPECT_EQ(of({1.0001f, 0, 0.25f, 0.5f}, Want::Any), Verdict::WrongT);
  EXPECT_EQ(of({nan, 0, 0.25f, 0.5f}), Verdict::WrongT);
  EXPECT_EQ(of({1, 0, nan, 0.5f}), Verdict::WrongT);
  EXPECT_EQ(of({1, 0, 0.25f, nan}), Verdict::WrongT);
  EXPECT_EQ(of({1, 0, 0.5f, 0.25f}), Verdict::WrongT);  // u and v exchanged
  EXPECT_EQ(of({1, 0, -0.25f, 0.5f}), Verdict::WrongT);
  Ray late = ray_;
  late.t_min = 1;
  EXPECT_EQ(of(late, {0.99999994f, 0, 0.25f, 0.5f}), Verdict::WrongT);  // outside of [t_min, t_max] by one ulp
}

TEST_F(JudgeErrors, WrongTriangle) {
  EXPECT_EQ(of({2, 1, 0.25f, 0.5f}), Verdict::WrongPrim);        // a farther triangle
  EXPECT_EQ(of({2, 1, 0.25f, 0.5f}, Want::Any), Verdict::Same);  // right for Want::Any
  EXPECT_EQ(of({1, 2, 0.25f, 0.5f}), Verdict::WrongPrim);        // a triangle beside the ray
  EXPECT_EQ(of({1, 2, 0.25f, 0.5f}, Want::Any), Verdict::WrongPrim);
  EXPECT_EQ(of({1, 77, 0.25f, 0.5f}), Verdict::WrongPrim);  // there is no such triangle
  EXPECT_EQ(of({1, 3, 0.25f, 0.5f}), Verdict::WrongPrim);   // the twin with the greater number
  EXPECT_EQ(of({1, 4, 0.5f, 0.25f}), Verdict::Tie);         // its arithmetic rounds differently
}

// A ray along a face of a twin's box may miss that box where boxes are tested as they are.
TEST_F(JudgeErrors, TwinsTieOnFacesOfBoxesWhereBoxesAreNotWidened) {
  const Ray edge{{0.25f, 0, 1}, 0, {0, 0, -1}, 10};
  const auto verdict = [&](const Ray& ray, const Hit& answer, Arithmetic arithmetic) {
    return scene_.oracle.judge(ray, answer, scene_.oracle.nearest(ray), Want::Nearest, arithmetic);
  };
  EXPECT_EQ(verdict(edge, {1, 3, 0.25f, 0}, Arithmetic::MoellerTrumbore), Verdict::Tie);
  EXPECT_EQ(verdict(edge, {1, 3, 0.25f, 0}, Arithmetic::Woop), Verdict::WrongPrim);
  EXPECT_EQ(verdict(ray_, {1, 3, 0.25f, 0.5f}, Arithmetic::MoellerTrumbore), Verdict::WrongPrim);
}

TEST_F(JudgeErrors, MissesAndHitsThatAreNone) {
  EXPECT_EQ(of(kMiss), Verdict::FalseMiss);
  EXPECT_EQ(of(kMiss, Want::Any), Verdict::FalseMiss);
  Ray beside = ray_;
  beside.origin.x = 3;
  EXPECT_EQ(of(beside, kMiss), Verdict::Same);
  EXPECT_EQ(of(beside, right_), Verdict::FalseHit);
  EXPECT_EQ(of(beside, {1, 77, 0, 0}, Want::Any), Verdict::FalseHit);
  Ray early = ray_;
  early.t_max = 0.5f;
  EXPECT_EQ(of(early, right_), Verdict::FalseHit);
  for (const Ray& dead : shapes::dead_rays()) {
    EXPECT_EQ(of(dead, kMiss), Verdict::Same);
    EXPECT_EQ(of(dead, right_), Verdict::FalseHit);
  }
}

TEST_F(JudgeErrors, OnAnEdgeBothAnswersAreTies) {
  Ray edge = ray_;
  edge.origin = {0.5f, -1e-9f, 1};
  EXPECT_EQ(of(edge, kMiss), Verdict::Same);
  EXPECT_EQ(of(edge, {1, 0, 0.5f, 0}), Verdict::Tie);
  edge.origin.y = 1e-9f;
  EXPECT_EQ(of(edge, kMiss), Verdict::Tie);
  edge.origin.y = 1e-4f;
  EXPECT_EQ(of(edge, kMiss), Verdict::FalseMiss);
  edge.origin.y = -1e-4f;
  EXPECT_EQ(of(edge, {1, 0, 0.5f, 0}), Verdict::FalseHit);
}

TEST_F(JudgeErrors, TheBatchCountsAndTells) {
  const std::vector<Ray> rays(5, ray_);
  const std::vector<Hit> answers{right_, kMiss, {2, 1, 0.25f, 0.5f}, {1.1f, 0, 0.25f, 0.5f}, {1, 4, 0.5f, 0.25f}};
  const Judgement j = scene_.oracle.judge(rays, answers, scene_.oracle.nearest(rays), Want::Nearest);
  EXPECT_EQ(std::tuple(j.rays, j.same, j.tie, j.false_miss, j.wrong_prim, j.wrong_t),
            std::tuple(5u, 1u, 1u, 1u, 1u, 1u));
  EXPECT_EQ(j.errors(), 3u);
  ASSERT_EQ(j.examples.size(), 3u);
  EXPECT_NE(j.examples[0].find("ray 1 (0.25 0.5 1, t_min 0"), std::string::npos) << j.examples[0];
  EXPECT_NE(j.examples[0].find("false miss"), std::string::npos);
  EXPECT_THROW(scene_.oracle.judge(rays, {}, {}, Want::Nearest), Error);
}

std::vector<Hit> embree(const Triangles& triangles, const std::vector<Ray>& rays) {
  const RTCDevice device = rtcNewDevice(nullptr);
  const RTCScene scene = rtcNewScene(device);
  rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
  const RTCGeometry mesh = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  void* vertices =
      rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, triangles.size() * 3);
  std::memcpy(vertices, triangles.data(), triangles.size() * sizeof(Triangle));
  auto* indices = static_cast<unsigned*>(
      rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, triangles.size()));
  for (unsigned i = 0; i < triangles.size() * 3; ++i) indices[i] = i;
  rtcCommitGeometry(mesh);
  rtcAttachGeometry(scene, mesh);
  rtcReleaseGeometry(mesh);
  rtcCommitScene(scene);
  std::vector<Hit> out;
  for (const Ray& r : rays) {
    RTCRayHit query{{r.origin.x, r.origin.y, r.origin.z, r.t_min, r.dir.x, r.dir.y, r.dir.z, 0, r.t_max, ~0u, 0, 0},
                    {}};
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene, &context, &query);
    out.push_back(query.hit.geomID == RTC_INVALID_GEOMETRY_ID
                      ? kMiss
                      : Hit{query.ray.tfar, query.hit.primID, query.hit.u, query.hit.v});
  }
  rtcReleaseScene(scene);
  rtcReleaseDevice(device);
  return out;
}

// Judges the answers of Embree. Its arithmetic is not that of the kernels, so rays close to an edge may leave the error
// bound. Their share is small and is printed.
TEST(Judge, EmbreeAgrees) {
  const Triangles triangles = shapes::grid(100);
  const Judged scene(triangles);
  const std::vector<Ray> rays = shapes::random_rays(50'000);
  const Judgement j = scene.oracle.judge(rays, embree(triangles, rays), scene.oracle.nearest(rays), Want::Nearest);
  std::printf("  Embree: %zu the same, %zu ties, %zu errors\n", static_cast<std::size_t>(j.same),
              static_cast<std::size_t>(j.tie), static_cast<std::size_t>(j.errors()));
  for (const std::string& line : j.examples) std::printf("  %s\n", line.c_str());
  EXPECT_LE(j.errors(), 5u);
  EXPECT_GT(j.same, 49'900u);
}

}  // namespace
}  // namespace ballot
