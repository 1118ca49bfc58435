// Streams of all kinds of questions through the buffers that they share: answers do not depend on what went before.
#include "engine/answer/ray_queries.h"
#include "engine/answer/stream.h"
#include "engine/scene/device_scene.h"
#include "tests/cpu/shapes.h"
#include "tests/device/fixture.h"

namespace ballot {
namespace {

using namespace harness;

class Streams : public DeviceTest, public testing::WithParamInterface<bool> {
 protected:
  /// What a scene answers to some questions of each kind.
  struct Answers {
    std::vector<Hit> hits;
    std::vector<Nearest> nearest;
    std::vector<std::uint32_t> inside, counts, listed;
    std::vector<Hit> lists, first;
  };

  void SetUp() override {
    Scene scene;
    scene.name = "sphere";
    scene.triangles = shapes::sphere(4);
    finish_scene(scene);
    DeviceSceneOptions options;
    options.context = gpu_, options.use_cache = false;
    world_ = std::make_unique<DeviceScene>(std::move(scene), options);
    rays_ = shapes::random_rays(kMost);
    for (const Ray& r : rays_) points_.push_back({r.origin, std::numeric_limits<float>::infinity()});
    gpu_->stream_ring().reset();
    if (GetParam()) StreamRing::of(*gpu_).act_as_gpu(kChunkOfTests);
  }
  void TearDown() override { gpu_->stream_ring().reset(); }

  RaySource source(std::size_t count) const {
    RaySource source;
    source.count = count;
    source.read = [this](std::uint64_t first, std::span<Ray> room) {
      std::copy_n(rays_.begin() + std::ptrdiff_t(first), room.size(), room.begin());
    };
    return source;
  }

  Answers ask(std::size_t count) {
    Answers a;
    a.hits.resize(count), a.nearest.resize(count), a.inside.resize(count), a.counts.resize(count);
    world_->points().nearest(std::span(points_).first(count), a.nearest);
    world_->trace(std::span(rays_).first(count), a.hits, {.method = "while-while"});
    world_->points().inside(std::span(points_).first(count), a.inside);
    world_->rays().count(source(count), [&](std::uint64_t first, std::span<const std::uint32_t> counts) {
      std::ranges::copy(counts, a.counts.begin() + std::ptrdiff_t(first));
    });
    world_->rays().list(source(count),
                        [&](std::uint64_t, std::span<const std::uint32_t> counts, std::span<const Hit> hits) {
                          a.listed.insert(a.listed.end(), counts.begin(), counts.end());
                          a.lists.insert(a.lists.end(), hits.begin(), hits.end());
                        });
    world_->rays().first(source(count), 3, [&](std::uint64_t, std::span<const Hit> hits) {
      a.first.insert(a.first.end(), hits.begin(), hits.end());
    });
    return a;
  }

  /// Expects the answers to be the first of these.
  static void expect_first(const Answers& some, const Answers& all) {
    const std::size_t n = some.hits.size();
    EXPECT_EQ(count_different(some.hits, std::span(all.hits).first(n)), 0u);
    EXPECT_EQ(std::memcmp(some.nearest.data(), all.nearest.data(), n * sizeof(Nearest)), 0);
    EXPECT_TRUE(std::equal(some.inside.begin(), some.inside.end(), all.inside.begin()));
    EXPECT_TRUE(std::equal(some.counts.begin(), some.counts.end(), all.counts.begin()));
    EXPECT_EQ(some.listed, some.counts);
    EXPECT_EQ(count_different(some.lists, std::span(all.lists).first(some.lists.size())), 0u);
    EXPECT_EQ(count_different(some.first, std::span(all.first).first(3 * n)), 0u);
  }

  static constexpr std::size_t kMost = 20000, kChunkOfTests = 3000;
  std::unique_ptr<DeviceScene> world_;
  std::vector<Ray> rays_;
  std::vector<ProbePoint> points_;
};

TEST_P(Streams, ShareBuffersOfAnySize) {
  const Answers all = ask(kMost);
  EXPECT_GT(std::ranges::count(all.inside, 1u), 100);
  for (const std::size_t count : {1, 5000, 300, 4097, int(kMost)}) expect_first(ask(count), all);
  gpu_->stream_ring().reset();
  if (GetParam()) StreamRing::of(*gpu_).act_as_gpu(kChunkOfTests);
  for (const std::size_t count : {10, 9000}) expect_first(ask(count), all);
}

// The chunks of one stream may carry others: what a stream has is its own.
TEST_P(Streams, MayBeginWhileAnotherIsUnderWay) {
  const Answers all = ask(kMost);
  std::vector<Hit> hits(kMost);
  RayStream stream = stream_of(std::span<const Ray>(rays_), std::span(hits));
  stream.take = [&, take = stream.take](std::uint64_t first, std::span<const Hit> some) {
    const std::vector<Hit> kept(some.begin(), some.end());
    take(first, kept);
    expect_first(ask(700), all);
  };
  world_->tracer().trace(stream, {.method = "while-while"});
  EXPECT_EQ(count_different(hits, all.hits), 0u);
}

TEST_P(Streams, MayEndByAnException) {
  const Answers all = ask(kMost);
  NearestStream stream{.most = kMost};
  stream.next = [&](std::uint64_t first, std::span<ProbePoint> room) {
    std::copy_n(points_.begin() + std::ptrdiff_t(first), room.size(), room.begin());
    return room.size();
  };
  stream.take = [](std::uint64_t, std::span<const Nearest>) { throw std::runtime_error("enough"); };
  EXPECT_THROW(world_->points().nearest(stream), std::runtime_error);
  stream.take = {};
  stream.next = [](std::uint64_t, std::span<ProbePoint>) -> std::size_t { throw std::runtime_error("no more"); };
  EXPECT_THROW(world_->points().nearest(stream), std::runtime_error);
  expect_first(ask(6000), all);
}

// Fewer questions than there is room for end a stream.
TEST_P(Streams, EndWhenNoMoreQuestionsCome) {
  std::uint64_t asked = 0, answered = 0;
  NearestStream stream;
  stream.next = [&](std::uint64_t first, std::span<ProbePoint> room) {
    EXPECT_EQ(first, asked);
    const std::size_t some = std::min<std::size_t>(room.size(), 100);
    std::copy_n(points_.begin(), some, room.begin());
    asked += some;
    return some;
  };
  stream.take = [&](std::uint64_t first, std::span<const Nearest> answers) {
    EXPECT_EQ(first, answered);
    answered += answers.size();
  };
  world_->points().nearest(stream);
  EXPECT_EQ(asked, 100u);
  EXPECT_EQ(answered, 100u);
}

INSTANTIATE_TEST_SUITE_P(OfADevice, Streams, testing::Bool(),
                         [](const auto& p) { return std::string(p.param ? "AsAGpu" : "AsItIs"); });

}  // namespace
}  // namespace ballot
