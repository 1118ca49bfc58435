// Tests of several devices and scenes in one process. Each thread owns a device and its scenes; a scene may change its
// tree.
#include <latch>
#include <thread>

#include "tests/device/fixture.h"
#include "tests/device/ray_sets.h"

namespace ballot {

namespace {

using Hits = std::vector<Hit>;

/// The results of one thread: the hits of each of its queries, the pixels of a small picture, and the validation
/// messages.
struct Answers {
  std::vector<Hits> hits;
  std::vector<float> picture;
  std::vector<std::string> messages;
};

std::vector<Query> some_queries() {
  std::vector<Query> queries;
  for (const char* method : {"while-while", "packet", "frontier", "bvh4"})
    for (const Want want : {Want::Nearest, Want::Any}) queries.push_back({want, method, std::string(kDefaultNumeric)});
  return queries;
}

class Concurrency : public DeviceTest {
 protected:
  void expect_right(Traced& t, std::span<const Ray> rays, const Query& query, const Hits& hits) {
    const Judgement j =
        t.oracle->judge(rays, hits, t.oracle->nearest(rays), query.want, judged_as(find_numeric(query.numeric)));
    EXPECT_EQ(j.errors(), 0u) << query.method << ": " << fmt::format("{}", fmt::join(j.examples, "\n"));
  }

  /// Opens a device, traces two scenes on it in turn, and renders a third.
  Answers answers_of_a_thread() {
    Answers out;
    auto gpu = std::make_shared<Context>(options());
    const auto first = make(*gpu, shapes::soup(1500, 0.2f)), second = make(*gpu, shapes::soup(400, 0.5f));
    const std::vector<Ray> rays = shapes::random_rays(777);
    for (const Query& query : some_queries())
      for (Traced* t : {first.get(), second.get()}) {
        Hits hits(rays.size());
        t->tracer->trace(rays, hits, query);
        expect_right(*t, rays, query, hits);
        out.hits.push_back(std::move(hits));
      }
    DeviceSceneOptions shared;
    shared.context = gpu;
    shared.use_cache = false;
    DeviceScene world(load_scene(BALLOT_SOURCE_DIR "/scenes/cornell.gltf"), shared);
    const Image image = world.render(world.scene().views[0], {.width = 24, .height = 24});
    out.picture = image.channel("G").floats;
    out.messages = gpu->messages();
    return out;
  }
};

TEST_F(Concurrency, TwoDevicesEachWithScenesAndAThreadOfItsOwn) {
  const Answers alone = answers_of_a_thread();
  Answers answers[2];
  std::latch start(2);
  {
    std::vector<std::jthread> threads;
    for (Answers& mine : answers)
      threads.emplace_back([&] {
        start.arrive_and_wait();
        mine = answers_of_a_thread();
      });
  }
  for (const Answers& a : answers) {
    EXPECT_EQ(a.messages, std::vector<std::string>{});
    EXPECT_EQ(a.picture, alone.picture);
    ASSERT_EQ(a.hits.size(), alone.hits.size());
    for (std::size_t i = 0; i < a.hits.size(); ++i)
      EXPECT_EQ(harness::count_different(a.hits[i], alone.hits[i]), 0u) << i;
  }
}

// Replaces the tree on the device by trees of other depths (and so other stacks), other bounds and other leaves.
TEST_F(Concurrency, ATracerFollowsItsTree) {
  Context gpu(options());
  const std::vector<shapes::Triangles> scenes{
      shapes::soup(40, 0.4f), shapes::soup(6000, 0.05f), {}, shapes::soup(1, 1), shapes::soup(40, 0.4f)};
  const std::vector<Ray> rays = shapes::random_rays(999);
  Traced t;
  std::vector<std::vector<Hits>> seen;
  std::vector<std::uint64_t> generations;
  for (const shapes::Triangles& triangles : scenes) {
    Bvh bvh = build_bvh(triangles);
    if (!t.tracer)
      t.tracer = std::make_unique<Tracer>(gpu, bvh, triangles, facts_of(bvh));
    else
      t.tracer->replace(bvh, triangles, facts_of(bvh));
    generations.push_back(t.tracer->tree().generation());
    t.oracle = std::make_unique<Oracle>(t.tracer->pair_tree(NodeLayout::Interleaved));
    auto& answers = seen.emplace_back();
    for (const Query& query : some_queries()) {
      Hits hits(rays.size());
      t.tracer->trace(rays, hits, query);
      expect_right(t, rays, query, hits);
      answers.push_back(std::move(hits));
    }
  }
  for (std::size_t i = 0; i < seen.front().size(); ++i)
    EXPECT_EQ(harness::count_different(seen.front()[i], seen.back()[i]), 0u) << "the first scene again: query " << i;
  std::ranges::sort(generations);
  EXPECT_EQ(std::ranges::adjacent_find(generations), generations.end()) << "a generation was given twice";
  expect_silent(gpu);
}

// Parts of a batch have the bits of the whole, and a launch takes about the time that it is given.
TEST_F(Concurrency, LaunchesAreCutToTheTimeGiven) {
  Context gpu(options());
  const auto t = make(gpu, shapes::soup(2000, 0.2f));
  const std::vector<Ray> rays = shapes::random_rays(200'000, 3, 1);
  Buffer<Ray> there(gpu, rays.size(), Access::Storage, "rays");
  there.upload(std::span(rays));
  Buffer<Hit> found(gpu, rays.size(), Access::Storage, "hits");
  Hits whole(rays.size()), cut(rays.size());
  for (const char* method : {"while-while", "packet"}) {
    const Query query{Want::Nearest, method, "watertight", {}};
    gpu.set_launch_ms(0);
    const double whole_ms = t->tracer->trace(there, found, std::uint32_t(rays.size()), query).device_ms;
    found.download(std::span(whole));
    gpu.set_launch_ms(whole_ms / 10);
    const TraceTimes times = t->tracer->trace(there, found, std::uint32_t(rays.size()), query);
    found.download(std::span(cut));
    EXPECT_GT(times.dispatches, 3u) << method;
    EXPECT_EQ(harness::count_different(whole, cut), 0u) << method;
  }
  expect_silent(gpu);
}

}  // namespace

}  // namespace ballot
