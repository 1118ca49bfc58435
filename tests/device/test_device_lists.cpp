// Lists of arrays on the device, beside what tests of lists hold them to (crossing_test.h, test_within.cpp): rooms that
// are too small, arrays that are, rays without lists, and hits alone.
#include "engine/core/error.h"
#include "tests/device/crossing_test.h"

namespace ballot {
namespace {

class DeviceListsTest : public CrossingTest {
 protected:
  void TearDown() override {
    if (gpu_) gpu_->stream_ring().reset();
    CrossingTest::TearDown();
  }
  template <class Call>
  static std::string refusal(const Call& call) {
    try {
      call();
    } catch (const Error& e) {
      return e.what();
    }
    return "none";
  }
};

TEST_F(DeviceListsTest, KeepWhatFitsAndTellHowManyThereAre) {
  const auto t = make(*gpu_, shapes::identical(30), {.builder = BuilderId::Balanced});
  RayQueries queries(*gpu_, t->tracer->tree());
  std::vector<Ray> rays;
  shapes::Random random(5);
  for (int i = 0; i < 900; ++i) rays.push_back({{random.in(-1, 1), random.in(-1, 1), 2}, 0, {0, 0, -1}, 9});
  const auto truth = listed(queries, rays);
  for (const bool as_gpu : {false, true}) {
    if (as_gpu) StreamRing::of(*gpu_).act_as_gpu(128);
    const RaysThere there(*gpu_, source_of(rays));
    for (const std::size_t room : {std::size_t(1), truth.hits.size() / 2, truth.hits.size() - 1}) {
      ArraysThere<Hit> to(*gpu_, rays.size(), room);
      EXPECT_EQ(queries.list(there.rays(), to.lists()).records, truth.hits.size());
      const std::size_t whole = room / 30 * 30;  // of lists that fit
      std::vector<Hit> found(whole);
      to.records.download(found);
      EXPECT_TRUE(whole == 0 || std::memcmp(found.data(), truth.hits.data(), whole * sizeof(Hit)) == 0);
      std::vector<std::uint32_t> counts(rays.size());
      to.counts.download(counts);
      EXPECT_EQ(counts, truth.counts);
    }
    // Counted alone, without offsets.
    ArraysThere<Hit> to(*gpu_, rays.size(), 5);
    EXPECT_EQ(queries.list(there.rays(), {to.counts}).records, truth.hits.size());
    to.expect(truth.counts, {}, {});
    EXPECT_EQ(queries.list(there.rays(), {to.counts}, {.most = 3}).records, truth.hits.size() / 10);
  }
}

// Lists that lanes put in order and that workgroups do, beside each other; then some that are left to the host.
TEST_F(DeviceListsTest, LongListsAreInOrder) {
  shapes::Random random(7);
  for (const std::vector<int>& stacks : {std::vector{400, 513, 700, 1024}, {600, 1025, 9}}) {
    shapes::Triangles layers;
    for (std::size_t k = 0; k < stacks.size(); ++k)
      for (int i = 0; i < stacks[k]; ++i) {
        const float x = 4 * float(k), z = float(random.below(90));
        layers.push_back({glm::vec3(x, 0, z), glm::vec3(x + 3, 0, z), glm::vec3(x, 3, z)});
      }
    const auto t = make(*gpu_, layers);
    RayQueries queries(*gpu_, t->tracer->tree());
    std::vector<Ray> rays;
    for (int i = 0; i < 1500; ++i)
      rays.push_back({{4 * float(i % 5) + random.in(0.1f, 1), random.in(0.1f, 1), 100}, 0, {0, 0, -1}, 1e4f});
    const auto found = lists(queries, rays);
    for (std::size_t k = 0; k < stacks.size(); ++k) EXPECT_EQ(found[k].size(), std::size_t(stacks[k]));
  }
}

// First crossings of more rays than have room for their whole lists at a time.
TEST_F(DeviceListsTest, BeginningsAreMadePartByPart) {
  const auto t = make(*gpu_, shapes::identical(520), {.builder = BuilderId::Balanced});
  RayQueries queries(*gpu_, t->tracer->tree());
  const std::vector<Ray> rays(8200, Ray{{0.2f, 0.2f, 2}, 0, {0, 0, -1}, 9});
  StreamRing::of(*gpu_).act_as_gpu(1 << 14);
  const RaysThere there(*gpu_, source_of(rays));
  ArraysThere<Hit> rows(*gpu_, 0, rays.size() * 20);
  queries.first(there.rays(), 20, rows.records);
  std::vector<Hit> truth(rays.size() * 20, first(queries, source_of(std::span(rays).first(1)), 1)[0]);
  for (std::uint32_t i = 0; i < truth.size(); ++i) truth[i].prim = i % 20;
  rows.expect({}, {}, truth);
}

TEST_F(DeviceListsTest, RefuseArraysThatAreTooSmall) {
  const auto t = make(*gpu_, shapes::grid(2));
  RayQueries queries(*gpu_, t->tracer->tree());
  const RaysThere there(*gpu_, source_of(shapes::random_rays(10)));
  ArraysThere<Hit> to(*gpu_, 10, 100), small(*gpu_, 9, 19);
  DeviceRays more = there.rays();
  more.count = 11;
  EXPECT_EQ(refusal([&] { queries.list(more, to.lists()); }), "lists on the device: found 10 rays; expected 11");
  EXPECT_EQ(refusal([&] { queries.list(there.rays(), {small.counts}); }),
            "lists on the device: found 9 counts; expected 10");
  EXPECT_EQ(refusal([&] {
              queries.list(there.rays(), {to.counts, &small.offsets});
            }),
            "lists on the device: found 10 offsets; expected 11");
  EXPECT_EQ(refusal([&] { queries.count(there.rays(), small.counts); }),
            "counts on the device: found 9 counts; expected 10");
  EXPECT_EQ(refusal([&] { queries.first(there.rays(), 2, small.records); }),
            "first crossings on the device: found 9 rows of 2 hits; expected 10");
  EXPECT_EQ(refusal([&] { queries.first(there.rays(), 0, to.records); }),
            "first crossings: found 0 of each ray; expected at least 1");
  small.expect({}, {}, {});
  DeviceRays none = there.rays();
  none.count = 0;
  EXPECT_EQ(queries.list(none, to.lists()).records, 0u);
  to.expect({}, std::vector<std::int64_t>{0}, {});
}

TEST_F(DeviceListsTest, AnyFirstHitIsOneOfTheList) {
  const auto t = make(*gpu_, shapes::soup(300, 0.7f));
  RayQueries queries(*gpu_, t->tracer->tree());
  const std::vector<Ray> rays = shapes::random_rays(800);
  const auto truth = lists(queries, rays);
  for (const bool as_gpu : {false, true}) {
    if (as_gpu) StreamRing::of(*gpu_).act_as_gpu(256);
    const RaysThere there(*gpu_, source_of(rays));
    ArraysThere<Hit> to(*gpu_, 0, rays.size());
    queries.first(there.rays(), 1, to.records, {.any = true});
    std::vector<Hit> found(rays.size());
    to.records.download(found);
    for (std::size_t i = 0; i < rays.size(); ++i)
      EXPECT_TRUE(truth[i].empty() ? found[i].prim == NO_HIT : std::ranges::any_of(truth[i], [&](const Hit& h) {
        return std::memcmp(&h, &found[i], sizeof h) == 0;
      }));
  }
}

TEST_F(DeviceListsTest, HitsAloneKeepTheirOrderAndNumbers) {
  const auto t = make(*gpu_, shapes::grid(2));
  RayQueries queries(*gpu_, t->tracer->tree());
  shapes::Random random(9);
  std::vector<Hit> all;
  std::vector<Hit> alone;
  std::vector<std::uint32_t> numbers;
  for (std::uint32_t i = 0; i < 9000; ++i) {
    const std::uint32_t prim = i > 100 && random.below(3) ? NO_HIT : i;
    all.push_back({float(i), prim, 0.25f, 0.5f});
    if (prim == NO_HIT || i >= 8999) continue;  // the last is not asked for
    alone.push_back(all.back()), numbers.push_back(i);
  }
  ArraysThere<Hit> from(*gpu_, 0, all.size()), to(*gpu_, 9000, alone.size() + 1), small(*gpu_, 9000, 100);
  from.records.upload(all);
  EXPECT_EQ(queries.hits_alone(from.records, 8999, 1, to.records, to.counts).records, alone.size());
  to.expect(numbers, {}, alone);
  EXPECT_EQ(queries.hits_alone(from.records, 8999, 1, small.records, small.counts).records, alone.size());
  small.expect(std::span(numbers).first(100), {}, std::span(alone).first(100));
  for (std::uint32_t& n : numbers) n /= 3;
  EXPECT_EQ(queries.hits_alone(from.records, 8999, 3, to.records, to.counts).records, alone.size());
  to.expect(numbers, {}, alone);
  EXPECT_EQ(queries.hits_alone(from.records, 0, 1, to.records, to.counts).records, 0u);
  EXPECT_NE(refusal([&] { queries.hits_alone(from.records, 9001, 1, to.records, to.counts); }), "none");
}

}  // namespace
}  // namespace ballot
