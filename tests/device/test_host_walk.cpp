// Holds walks of the host to the kernels whose answers they give: bit for bit, on every set of rays and about every
// kind of mesh.
#include "engine/answer/host_walk.h"
#include "engine/answer/point_queries.h"
#include "tests/device/fixture.h"
#include "tests/device/scene_cases.h"

namespace ballot {
namespace {

using namespace harness;
using namespace scene_cases;

constexpr std::size_t kFew = 16;  // points that the host answers

class HostWalks : public DeviceTest, public testing::WithParamInterface<SceneCase> {
 protected:
  void SetUp() override {
    gpu_->set_answers_few(true);
    if (gpu_->info().known_driver() != Driver::Llvmpipe) GTEST_SKIP() << "the device answers everything";
  }
  void TearDown() override {
    gpu_->set_answers_few(false);
    DeviceTest::TearDown();
  }
  template <class T>
  static bool same(const T& a, const T& b) {
    return std::memcmp(&a, &b, sizeof(T)) == 0;
  }
};

TEST_P(HostWalks, FindTheHitsOfTheKernelsBitForBit) {
  const auto t = make(*gpu_, GetParam().make());
  const std::vector<Ray> rays = rays_about(t->triangles, t->bvh);
  std::vector<Hit> hits(rays.size());
  t->tracer->trace(rays, hits, {.method = "while-while"});
  for (const NodeLayout layout : {NodeLayout::Interleaved, NodeLayout::Compact}) {
    const auto walk = HostWalk::over(*gpu_, t->tracer->tree(), HostWalk::Of::Rays, layout);
    ASSERT_TRUE(walk);
    std::size_t different = 0, other = 0;
    std::vector<Hit> any(rays.size());
    for (std::size_t i = 0; i < rays.size(); ++i) {
      different += !same(walk->trace(rays[i], Want::Nearest), hits[i]);
      any[i] = walk->trace(rays[i], Want::Any);
      other += (any[i].prim == NO_HIT) != (hits[i].prim == NO_HIT);
    }
    EXPECT_EQ(different, 0u);
    EXPECT_EQ(other, 0u);
    const auto truth = t->oracle->nearest(rays);
    EXPECT_EQ(t->oracle->judge(rays, any, truth, Want::Any, Arithmetic::Woop).errors(), 0u);
  }
}

TEST_P(HostWalks, FindTheNearestPointsOfTheKernelsBitForBit) {
  const auto t = make(*gpu_, GetParam().make());
  PointQueries queries(*gpu_, t->tracer->tree());
  const std::vector<ProbePoint> points = probes_about(t->triangles, t->bvh.bounds);
  std::vector<Nearest> found(points.size());
  gpu_->set_answers_few(false);
  queries.nearest(points, found);
  gpu_->set_answers_few(true);
  const auto walk = HostWalk::over(*gpu_, t->tracer->tree(), HostWalk::Of::Points);
  ASSERT_TRUE(walk);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Nearest n = walk->nearest(points[i]);
    ASSERT_TRUE(same(n, found[i])) << i << ": " << n.prim << " " << n.distance << " " << n.u << " " << n.v << ", not "
                                   << found[i].prim << " " << found[i].distance << " " << found[i].u << " "
                                   << found[i].v;
  }
  std::vector<Nearest> few(20);
  queries.nearest(std::span(points).first(20), few);
  EXPECT_TRUE(std::memcmp(few.data(), found.data(), 20 * sizeof(Nearest)) == 0);
}

TEST_P(HostWalks, FindTheSidesOfTheKernelsBitForBit) {
  const auto t = make(*gpu_, GetParam().make());
  PointQueries queries(*gpu_, t->tracer->tree());
  const PointQuery sides{.sides = true};
  const std::vector<ProbePoint> points = probes_about(t->triangles, t->bvh.bounds);
  std::vector<Nearest> found(points.size()), few(kFew);
  std::vector<std::uint32_t> inside(points.size()), few_inside(kFew);
  gpu_->set_answers_few(false);
  queries.nearest(points, found, sides);
  queries.inside(points, inside);
  gpu_->set_answers_few(true);
  for (std::size_t i = 0; i + kFew <= points.size(); i += kFew) {
    const auto some = std::span(points).subspan(i, kFew);
    EXPECT_EQ(queries.nearest(some, few, sides).dispatches, 0u);
    EXPECT_EQ(queries.inside(some, few_inside).dispatches, 0u);
    for (std::size_t k = 0; k < kFew; ++k) {
      ASSERT_TRUE(same(few[k], found[i + k])) << i + k << ": " << few[k].behind << ", not " << found[i + k].behind;
      ASSERT_EQ(few_inside[k], inside[i + k]) << i + k;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, HostWalks, testing::ValuesIn(kScenes), [](const auto& p) { return p.param.name; });
INSTANTIATE_TEST_SUITE_P(Scaled, HostWalks, testing::ValuesIn(kFarSmallLarge),
                         [](const auto& p) { return p.param.name; });

// Walks in the layout of which the kernels of this driver know nothing.
TEST_F(HostWalks, FindTheNearestPointsInEveryLayout) {
  const auto t = make(*gpu_, shapes::soup(2000, 0.2f));
  std::vector<ProbePoint> points = probes_about(t->triangles, t->bvh.bounds);
  std::erase_if(points,
                [](const ProbePoint& p) { return !(std::abs(p.at.x) < 20); });  // answers to far ones may differ
  const auto a = HostWalk::over(*gpu_, t->tracer->tree(), HostWalk::Of::Points, NodeLayout::Interleaved),
             b = HostWalk::over(*gpu_, t->tracer->tree(), HostWalk::Of::Points, NodeLayout::Compact);
  ASSERT_TRUE(a && b);
  for (const ProbePoint& p : points) {
    EXPECT_TRUE(same(a->nearest(p), b->nearest(p)));
    EXPECT_EQ(a->inside(p.at), b->inside(p.at));
  }
}

TEST_F(HostWalks, AnswerWhatIsFewAlone) {
  const auto t = make(*gpu_, shapes::sphere(4));
  const auto dispatches = [&](std::size_t count, const Query& query) {
    std::vector<Hit> hits(count);
    return t->tracer->trace(shapes::random_rays(count), hits, query).dispatches;
  };
  EXPECT_EQ(dispatches(1, {}), 0u);
  EXPECT_EQ(dispatches(1, {.want = Want::Any}), 0u);
  EXPECT_GT(dispatches(1 << 14, {}), 0u);
  EXPECT_GT(dispatches(1, {.method = "while-while"}), 0u);
  EXPECT_GT(dispatches(1, {.numeric = "plain"}), 0u);
  EXPECT_GT(dispatches(1, {.knobs = {{"sorted", "0"}}}), 0u);
  gpu_->set_answers_few(false);
  EXPECT_GT(dispatches(1, {}), 0u);
}

}  // namespace
}  // namespace ballot
