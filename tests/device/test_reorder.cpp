// Tests of ray reordering: whatever the order in which rays are traced, each gets its own hit.
#include <algorithm>
#include <cstring>

#include "engine/answer/reorder.h"
#include "tests/cpu/shapes.h"
#include "tests/device/fixture.h"

namespace ballot {
namespace {

using namespace harness;

class ReorderTest : public DeviceTest {
 protected:
  static void SetUpTestSuite() {
    gpu_ = std::make_unique<Context>(options());
    scene_ = make(*gpu_, shapes::soup(3000, 0.1f));
    rays_ = shapes::random_rays(5000);
    for (std::size_t i = 0; i < rays_.size(); i += 7) rays_[i].t_max = -1;                    // dead
    for (std::size_t i = 1; i < rays_.size(); i += 97) rays_[i].dir.x = std::nanf("");        // dead
    for (std::size_t i = 2; i < rays_.size(); i += 5) rays_[i].dir = {0, 0, i % 2 ? 1 : -1};  // along an axis
  }
  static void TearDownTestSuite() { scene_.reset(), gpu_.reset(); }

  /// Returns who can sort here: the device or, where it shares the host's memory, the host too.
  static std::vector<bool> by_host() {
    return gpu_->info().is_cpu() ? std::vector<bool>{true, false} : std::vector<bool>{false};
  }
  /// A tracer whose rays are sorted by the host or by the device.
  static std::unique_ptr<Tracer> tracer(bool on_host) {
    auto made = std::make_unique<Tracer>(*gpu_, scene_->bvh, scene_->triangles, facts_of(scene_->bvh));
    made->sort_on_host = on_host;
    return made;
  }
  static std::vector<Hit> trace(Tracer& tracer, Query query, bool reorder) {
    query.knobs["reorder"] = reorder ? "1" : "0";
    std::vector<Hit> hits(rays_.size());
    tracer.trace(rays_, hits, query);
    return hits;
  }
  static Buffer<Ray> ray_buffer() {
    Buffer<Ray> buffer(*gpu_, rays_.size(), Access::Storage, "rays");
    buffer.upload(rays_);
    return buffer;
  }
  static Buffer<Hit> hit_buffer() {
    Buffer<Hit> buffer(*gpu_, rays_.size(), Access::Storage, "hits");
    buffer.upload(std::vector<Hit>(rays_.size(), kNone));
    return buffer;
  }
  template <class T>
  static std::vector<T> downloaded(const Buffer<T>& buffer) {
    std::vector<T> all(buffer.size());
    buffer.download(std::span(all));
    return all;
  }

  static constexpr Hit kNone{-1, 77, -1, -1};
  static inline std::unique_ptr<Traced> scene_;
  static inline std::vector<Ray> rays_;
};

TEST_F(ReorderTest, EveryRayGetsItsOwnHit) {
  for (const bool on_host : by_host()) {
    const auto sorts = tracer(on_host);
    for (const Query& q : every_method(Want::Nearest, kDefaultNumeric)) {
      EXPECT_EQ(count_different(trace(*sorts, q, false), trace(*sorts, q, true)), 0u) << q.method << ", " << on_host;
    }
    const Query any{.want = Want::Any, .method = "while-while"};
    EXPECT_EQ(count_different(trace(*sorts, any, false), trace(*sorts, any, true)), 0u) << on_host;
  }
}

// Neighbours start near each other. The rays given are a permutation of those that come out.
TEST_F(ReorderTest, NeighboursAreAlike) {
  const Buffer<Ray> given = ray_buffer();
  const auto apart = [](const std::vector<Ray>& rays) {
    double sum = 0;
    for (std::size_t i = 1; i < rays.size(); ++i)
      if (rays[i - 1].t_max > 0 && rays[i].t_max > 0) sum += glm::distance(rays[i - 1].origin, rays[i].origin);
    return sum;
  };
  const auto bytes_less = [](const Ray& a, const Ray& b) { return std::memcmp(&a, &b, sizeof a) < 0; };
  for (const bool on_host : by_host()) {
    Reorder reorder(*gpu_, on_host);
    double ms = 0;
    const std::uint32_t first = 100, count = std::uint32_t(rays_.size()) - 300;
    reorder.sort({given, {first, first + count}}, scene_->bvh.bounds, [&](double some) { ms += some; });
    gpu_->finish();
    std::vector<Ray> in_order = downloaded(reorder.rays());
    in_order.resize(count);
    std::vector<Ray> expected(rays_.begin() + first, rays_.begin() + first + count);
    EXPECT_LT(apart(in_order), 0.5 * apart(expected)) << on_host;
    EXPECT_GT(ms, 0);
    std::ranges::sort(in_order, bytes_less);
    std::ranges::sort(expected, bytes_less);
    EXPECT_EQ(std::memcmp(in_order.data(), expected.data(), count * sizeof(Ray)), 0) << on_host;
  }
}

TEST_F(ReorderTest, CountersGoToTheirRays) {
  const Buffer<Ray> given = ray_buffer();
  for (const bool on_host : by_host()) {
    const auto sorts = tracer(on_host);
    std::vector<std::vector<RayStats>> stats;
    for (const char* reorder : {"0", "1"}) {
      Buffer<Hit> hits = hit_buffer();
      Buffer<RayStats> counted(*gpu_, rays_.size(), Access::Storage, "counters");
      const Query query{.method = "while-while", .knobs = {{"reorder", reorder}}};
      sorts->trace_counted(given, hits, std::uint32_t(rays_.size()), query, counted);
      stats.push_back(downloaded(counted));
    }
    std::size_t different = 0;
    for (std::size_t i = 0; i < rays_.size(); ++i)
      different += stats[0][i].nodes != stats[1][i].nodes || stats[0][i].triangles != stats[1][i].triangles;
    EXPECT_EQ(different, 0u) << on_host;
  }
}

TEST_F(ReorderTest, RecordedTracesMayReadTheirCountOnTheDevice) {
  const auto sorts = tracer(false);
  const auto count = std::uint32_t(rays_.size() - 1234);
  const Query plain{.method = "while-while"}, query{.method = "while-while", .knobs = {{"reorder", "1"}}};
  if (!sorts->can_record(query, count)) {
    EXPECT_FALSE(sorts->can_record(plain, count));  // the driver has loops cut short, so the host has to look
    return;
  }
  EXPECT_FALSE(tracer(true)->can_record(query, count));  // the host would have to wait
  const Buffer<Ray> given = ray_buffer();
  const std::vector<Hit> expected = trace(*sorts, plain, false);
  const RayGroups groups = sorts->groups_of(query);
  Buffer<IndirectArgs> args(*gpu_, 2, Access::Storage | Access::Indirect, "arguments");
  args.upload(std::vector<IndirectArgs>{{}, {(count + groups.rays - 1) / groups.rays, 1, 1, count}});
  for (const bool indirect : {false, true}) {
    Buffer<Hit> hits = hit_buffer();
    const PassScope scope(*gpu_);
    int told = 0;
    const auto done = [&](double) { ++told; };
    if (indirect)
      sorts->record(given, hits, IndirectRays{args, 1}, query, done);
    else
      sorts->record(given, hits, count, query, done);
    gpu_->finish();
    EXPECT_EQ(told, 1);  // of all passes together
    const std::vector<Hit> all = downloaded(hits);
    EXPECT_EQ(count_different({all.begin(), all.begin() + count}, {expected.begin(), expected.begin() + count}), 0u);
    EXPECT_TRUE(std::all_of(all.begin() + count, all.end(), [](const Hit& h) { return h.prim == kNone.prim; }));
  }
}

TEST(ReorderSorts, DevicesWithoutShuffleSayWhy) {
  DeviceInfo device;
  device.name = "a GPU";
  device.subgroup_size = 32;
  EXPECT_FALSE(can_reorder(device));
  EXPECT_THROW(check_can_reorder(device), Error);
  device.shuffle = true;
  EXPECT_TRUE(can_reorder(device));
}

}  // namespace
}  // namespace ballot
