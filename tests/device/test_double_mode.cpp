// Numeric mode double: every method gives the bits of the oracle in double, on every ray set, for rays of float32 and
// in double and for vertices in double.
#include "engine/oracle/in_double.h"
#include "engine/tree/device/double_corners.h"
#include "tests/device/fixture.h"
#include "tests/device/ray_sets.h"
#include "tests/device/scene_cases.h"

namespace ballot {
namespace {

using namespace harness;

class DoubleMode : public DeviceTest {
 protected:
  static Hit rounded_hit(const OracleHit& h) {
    if (h.prim == NO_HIT) return {std::numeric_limits<float>::infinity(), NO_HIT, 0, 0};
    return {float(h.t) + 0.f, h.prim, float(h.u), float(h.v)};  // kernels report no -0
  }
  static std::vector<Hit> trace(Traced& t, std::span<const RayInDouble> rays, const Query& query) {
    std::vector<Hit> hits(rays.size());
    t.tracer->trace(stream_of(rays, std::span(hits)), query);
    return hits;
  }
  /// Returns the number of hits that differ in some bit; on a GPU, whose divisions may round otherwise, in the prim.
  static std::size_t different(std::span<const Hit> a, std::span<const Hit> b) {
    return gpu_->info().is_cpu() ? count_different(a, b) : count_other_prims(a, b);
  }
  static std::vector<Ray> all_rays(const Traced& t) {
    std::vector<Ray> rays;
    for (const shapes::RaySet& set : shapes::ray_sets(t.triangles, t.bvh))
      rays.insert(rays.end(), set.rays.begin(), set.rays.end());
    return rays;
  }
  /// Gives a tree vertices in double of which its own are the roundings.
  static std::vector<CornersInDouble> take_doubles(Traced& t) {
    shapes::Random random(11);
    std::vector<CornersInDouble> corners;
    for (const Triangle& triangle : t.triangles) {
      CornersInDouble& c = corners.emplace_back(widened(triangle));
      for (glm::dvec3& v : c)
        for (int k = 0; k < 3; ++k) v[k] *= 1 + 0x1p-25 * double(random.in(-0.99f, 0.99f));
    }
    t.tracer->tree().set_doubles(std::make_shared<DoubleCorners>(corners, std::vector<std::size_t>{0}, 0.f));
    return corners;
  }
};

TEST_F(DoubleMode, EveryMethodHasTheBitsOfTheOracle) {
  if (!gpu_->info().float64) GTEST_SKIP() << "the device lacks float64";
  if (!at_default_size(gpu_->info())) GTEST_SKIP() << "lavapipe compiles too long";
  const auto t = make(*gpu_, shapes::soup(3000, 0.1f));
  const std::vector<Ray> rays = all_rays(*t);
  const OracleInDouble oracle(t->tracer->pair_tree(NodeLayout::Interleaved), t->triangles, {});
  std::vector<Hit> truth;
  for (const Ray& ray : rays) truth.push_back(rounded_hit(oracle.nearest(in_double(ray))));
  for (std::size_t i = 0; i < rays.size(); i += 37)
    EXPECT_EQ(oracle.nearest(in_double(rays[i])).prim, oracle.brute_force(in_double(rays[i])).prim);
  for (const Query& q : every_method(Want::Nearest, "double")) {
    std::vector<Hit> hits(rays.size());
    t->tracer->trace(rays, hits, q);
    EXPECT_EQ(different(truth, hits), 0u) << q.method;
  }
  for (const char* method : {"packet", "dynamic-fetch", "frontier", "bvh4-turns", "packet-wide"}) {
    std::vector<Hit> hits(rays.size());
    t->tracer->trace(rays, hits, {.want = Want::Any, .method = method, .numeric = "double"});
    for (std::size_t i = 0; i < rays.size(); ++i)
      EXPECT_EQ(hits[i].prim == NO_HIT, truth[i].prim == NO_HIT) << method << ", ray " << i;
  }
}

TEST_F(DoubleMode, RaysAndVerticesInDoubleHaveTheBitsOfTheOracle) {
  if (!gpu_->info().float64) GTEST_SKIP() << "the device lacks float64";
  if (!at_default_size(gpu_->info())) GTEST_SKIP() << "lavapipe compiles too long";
  for (const float budget : {0.f, 4.f}) {  // without and with triangles that several leaves hold
    const auto t = make(*gpu_, shapes::soup(3000, 0.1f), {.split_budget = budget});
    const std::vector<CornersInDouble> corners = take_doubles(*t);
    const OracleInDouble oracle(t->tracer->pair_tree(NodeLayout::Interleaved), t->triangles, corners);
    shapes::Random random(5);
    std::vector<RayInDouble> rays;
    for (const Ray& ray : all_rays(*t)) {
      RayInDouble& r = rays.emplace_back(in_double(ray));
      for (int k = 0; k < 3; ++k)
        r.origin[k] *= 1 + 0x1p-26 * double(random.in(-1, 1)), r.dir[k] *= 1 + 0x1p-26 * double(random.in(-1, 1));
    }
    std::vector<Hit> truth;
    for (const RayInDouble& ray : rays) truth.push_back(rounded_hit(oracle.nearest(ray)));
    for (std::size_t i = 0; i < rays.size(); i += 97)
      EXPECT_EQ(oracle.nearest(rays[i]).prim, oracle.brute_force(rays[i]).prim);
    for (const char* method : {"while-while", "packet-wide"})
      EXPECT_EQ(different(truth, trace(*t, rays, {.method = method, .numeric = "double"})), 0u) << method;
    const auto any = trace(*t, rays, {.want = Want::Any, .method = "while-while", .numeric = "double"});
    for (std::size_t i = 0; i < rays.size(); ++i) EXPECT_EQ(any[i].prim == NO_HIT, truth[i].prim == NO_HIT) << i;
  }
}

TEST_F(DoubleMode, WalksThatADriverCutsShortAreFinished) {
  if (!gpu_->info().float64) GTEST_SKIP() << "the device lacks float64";
  const auto t = make(*gpu_, shapes::identical(40000), {.max_leaf = 2, .split_budget = 0});
  const auto rays = shapes::random_rays(33);
  const OracleInDouble oracle(t->tracer->pair_tree(NodeLayout::Interleaved), t->triangles, {});
  std::vector<RayInDouble> wide;
  std::vector<Hit> truth, hits(rays.size());
  for (const Ray& ray : rays) wide.push_back(in_double(ray)), truth.push_back(rounded_hit(oracle.nearest(wide.back())));
  const Query query{.method = "while-while", .numeric = "double"};
  EXPECT_EQ(different(truth, trace(*t, wide, query)), 0u);
  t->tracer->trace(rays, hits, query);
  EXPECT_EQ(different(truth, hits), 0u);
}

TEST_F(DoubleMode, OtherModesRefuseRaysInDouble) {
  const auto t = make(*gpu_, shapes::soup(30, 0.1f));
  const std::vector<RayInDouble> rays(3);
  EXPECT_THROW(trace(*t, rays, {.method = "while-while"}), Error);
}

}  // namespace
}  // namespace ballot
