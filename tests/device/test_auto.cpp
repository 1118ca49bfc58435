// Tests of method auto: its candidates, its behaviour with few and with many rays, and the choices that it stores.
#include <atomic>
#include <filesystem>
#include <thread>

#include "engine/core/error.h"
#include "engine/core/file.h"
#include "engine/trace/auto/coherence.h"
#include "tests/cpu/shapes.h"
#include "tests/device/fixture.h"

namespace ballot {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMany = 1 << 15;  // enough rays for a trial on a CPU

class Auto : public DeviceTest {
 protected:
  static void SetUpTestSuite() { gpu_ = std::make_unique<Context>(options()); }
  static void TearDownTestSuite() { gpu_.reset(); }
  void SetUp() override {
    if (!gpu_->info().is_cpu()) GTEST_SKIP() << "sample sizes are those of CPU devices";
    scene_ = make(*gpu_, shapes::soup(3000, 0.1f));
  }

  std::vector<Hit> trace(const std::vector<Ray>& rays, const Query& query) const {
    std::vector<Hit> hits(rays.size());
    scene_->tracer->trace(rays, hits, query);
    return hits;
  }

  const Choice* choice_for(const std::vector<Ray>& rays, Query query) const {
    query.rays = scene_->tracer->ray_class(rays);
    return scene_->tracer->choices().find(query);
  }

  inline static std::unique_ptr<Context> gpu_;
  std::unique_ptr<Traced> scene_;
};

const Query kAny{.want = Want::Any};

TEST_F(Auto, FindsWhatOtherMethodsFind) {
  const auto rays = shapes::random_rays(kMany);
  const auto hits = trace(rays, {});
  EXPECT_EQ(harness::count_untouched(hits), 0u);
  EXPECT_EQ(harness::count_different(hits, trace(rays, {.method = "if-if"})), 0u);
  const Choice* choice = choice_for(rays, {});
  ASSERT_TRUE(choice);
  EXPECT_EQ(choice->sampled, kMany);
  EXPECT_TRUE(choice->chosen().tried);
  EXPECT_FALSE(choice->remembered);
  EXPECT_GT(choice->seconds, 0);
  EXPECT_EQ(choice->candidates.size(), candidates_for({}, gpu_->info()).size());
  for (const Candidate& c : choice->candidates) {
    EXPECT_EQ(c.mrays_per_s > 0, c.tried) << c.name();
    EXPECT_LE(c.mrays_per_s, choice->chosen().mrays_per_s * 1.03) << c.name();  // 2 % are noise to auto
  }
  const Query resolved = scene_->tracer->resolve({.rays = choice->rays});
  EXPECT_EQ(resolved.method, choice->chosen().method);
  EXPECT_EQ(scene_->tracer->variant({.rays = choice->rays}).method->name, resolved.method);
  EXPECT_FALSE(choice_for(rays, kAny));
  expect_silent(*gpu_);
}

// The plainest method traces the first of these rays, and the chosen one those behind.
TEST_F(Auto, EveryRayIsTracedBeforeOrAfterTheTrial) {
  const auto rays = shapes::random_rays(2 * kMany + 77);
  const auto nearest = trace(rays, {}), any = trace(rays, kAny), expected = trace(rays, {.method = "if-if"});
  EXPECT_EQ(harness::count_untouched(nearest) + harness::count_untouched(any), 0u);
  EXPECT_EQ(harness::count_different(nearest, expected), 0u);
  for (std::size_t i = 0; i < rays.size(); ++i)
    ASSERT_EQ(any[i].prim == NO_HIT, expected[i].prim == NO_HIT) << "ray " << i;
  EXPECT_TRUE(choice_for(rays, {}) && choice_for(rays, kAny));
  expect_silent(*gpu_);
}

TEST_F(Auto, MeasuresNothingOnFewRays) {
  const auto rays = shapes::random_rays(1000);
  EXPECT_EQ(harness::count_different(trace(rays, {}), trace(rays, {.method = "packet"})), 0u);
  EXPECT_TRUE(scene_->tracer->choices().all().empty());
  EXPECT_EQ(scene_->tracer->resolve(Query{}).method, kPlainestMethod);
}

TEST_F(Auto, SortsOfRaysHaveChoicesOfTheirOwn) {
  const auto random = shapes::random_rays(kMany);
  std::vector<Ray> parallel(kMany, {{0, 0, 5}, 0, {0.1f, 0.2f, -1}, 1e30f});
  trace(random, kAny);
  trace(parallel, kAny);
  const auto all = scene_->tracer->choices().all();
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0].rays, "foreign: coherent, long");
  EXPECT_EQ(all[1].rays, "foreign: incoherent, long");
}

TEST_F(Auto, CandidatesFollowTheQuery) {
  const auto names = [&](const Query& query) {
    std::vector<std::string> all;
    for (const Candidate& c : candidates_for(query, gpu_->info())) all.push_back(c.name());
    return all;
  };
  using Names = std::vector<std::string>;
  EXPECT_EQ(names({}), (Names{"while-while", "bvh4-turns", "packet-wide fallback=0 rays=2", "dynamic-fetch",
                              "packet-wide fallback=0"}));
  EXPECT_EQ(names({.rays = "primary"}), (Names{"while-while", "packet-wide fallback=0 rays=2", "bvh4-turns",
                                               "dynamic-fetch", "packet-wide fallback=0"}));
  EXPECT_EQ(names({.rays = "foreign: mixed, long"}), names({}));
  EXPECT_EQ(names({.knobs = {{"fallback", "1"}}}), (Names{"packet-wide fallback=1 rays=2", "packet-wide fallback=1"}));
  EXPECT_EQ(names({.knobs = {{"rays", "4"}}}), (Names{"packet-wide fallback=0 rays=4"}));
  EXPECT_EQ(names({.knobs = {{"sorted", "0"}}}),
            (Names{"while-while sorted=0", "packet-wide fallback=0 rays=2 sorted=0", "dynamic-fetch sorted=0",
                   "packet-wide fallback=0 sorted=0"}));
  EXPECT_EQ(names({.knobs = {{"refetch", "0.25"}}}), (Names{"bvh4-turns refetch=0.25", "dynamic-fetch refetch=0.25"}));
  if (gpu_->info().float64) {
    EXPECT_EQ(names({.numeric = "exact"}), (Names{"while-while", "dynamic-fetch"}));
  }
  const auto in_large = candidates_for({}, gpu_->info(), 1 << 16);
  ASSERT_EQ(in_large.size(), 7u);
  EXPECT_EQ(in_large[4].name(), "bvh4-turns reorder=1");
  EXPECT_EQ(in_large[5].name(), "while-while reorder=1");  // where the host would have to collapse the tree
  EXPECT_EQ(candidates_for({.rays = "primary"}, gpu_->info(), 1 << 16).size(), 5u);  // coherent rays are not sorted
  EXPECT_EQ(entry_seconds({"packet-wide", {{"fallback", "0"}, {"rays", "2"}}}, gpu_->info()), 0.17);
  EXPECT_EQ(entry_seconds({"packet-wide", {{"fallback", "0"}}}, gpu_->info()), 0.34);
  EXPECT_EQ(entry_seconds({"packet-wide", {{"fallback", "1"}}}, gpu_->info()), 0.34);
  EXPECT_EQ(entry_seconds({"bvh4-turns", {}}, gpu_->info()), 0.15);
  EXPECT_EQ(entry_seconds({"bvh4-turns", {{"reorder", "1"}}}, gpu_->info()), 0.2);
  EXPECT_THROW(names({.knobs = {{"vote", "any"}}}), Error);
  EXPECT_THROW(names({.knobs = {{"speed", "9"}}}), Error);
}

TEST_F(Auto, ChoicesOutliveTheProcess) {
  const fs::path folder = fs::temp_directory_path() / fmt::format("ballot-auto-{}", ::getpid());
  scene_->tracer->choices().keep_in(folder);
  const auto rays = shapes::random_rays(kMany);
  trace(rays, {});
  const Choice* first = choice_for(rays, {});
  ASSERT_FALSE(first->remembered);
  Tracer again(*gpu_, scene_->bvh, scene_->triangles, facts_of(scene_->bvh));
  again.choices().keep_in(folder);
  const auto all = again.choices().all();
  ASSERT_EQ(all.size(), 1u);
  EXPECT_TRUE(all[0].remembered);
  EXPECT_EQ(all[0].chosen().name(), first->chosen().name());
  EXPECT_EQ(all[0].complete(), first->complete());
  std::size_t files = 0;
  for (const auto& file : fs::directory_iterator(folder)) {
    write_file(file.path(), std::string_view("{\"scene\": 1"));
    ++files;
  }
  EXPECT_EQ(files, 1u);
  Tracer damaged(*gpu_, scene_->bvh, scene_->triangles, facts_of(scene_->bvh));
  damaged.choices().keep_in(folder);
  EXPECT_TRUE(damaged.choices().all().empty());
  fs::remove_all(folder);
}

TEST_F(Auto, WhatEarlierProcessesTracedCountsForWhatWasPutOff) {
  const fs::path folder = fs::temp_directory_path() / fmt::format("ballot-auto-paid-{}", ::getpid());
  const auto rays = shapes::random_rays(kMany);
  const Query query{.rays = scene_->tracer->ray_class(rays)};
  {
    Tracer tracer(*gpu_, scene_->bvh, scene_->triangles, facts_of(scene_->bvh));
    tracer.choices().keep_in(folder);
    Choice choice{query.rays, query.want, query.numeric, {}, candidates_for(query, gpu_->info())};
    for (Candidate& c : choice.candidates) c.tried = true;
    choice.candidates.front().mrays_per_s = 10;
    choice.candidates.back().tried = false;
    choice.candidates.back().put_off_s = 5;
    tracer.choices().add(choice);
    std::vector<Hit> hits(rays.size());
    tracer.trace(rays, hits, query);
    tracer.choices().note(query, 50'000'000);
    EXPECT_EQ(tracer.choices().find(query)->candidates.back().tried, false);
  }
  Tracer next(*gpu_, scene_->bvh, scene_->triangles, facts_of(scene_->bvh));
  next.choices().keep_in(folder);
  ASSERT_TRUE(next.choices().find(query));
  EXPECT_GT(next.choices().find(query)->since_entry_s, 5);
  EXPECT_LT(next.choices().find(query)->since_entry_s, 5.1);
  EXPECT_EQ(next.choices().find(query)->traced_s, 0);
  fs::remove_all(folder);
}

// Other processes hold the processors meanwhile.
TEST_F(Auto, ThreeProcessesLeaveNoCandidate) {
  const fs::path folder = fs::temp_directory_path() / fmt::format("ballot-auto-three-{}", ::getpid());
  std::vector<std::jthread> others;
  for (int i = 0; i < 4; ++i)
    others.emplace_back([](const std::stop_token& stop) {
      while (!stop.stop_requested()) std::atomic_signal_fence(std::memory_order_seq_cst);
    });
  const auto rays = shapes::random_rays(kMany);
  for (int run = 1; run <= kRunsOfTrials; ++run) {
    Tracer tracer(*gpu_, scene_->bvh, scene_->triangles, facts_of(scene_->bvh));
    tracer.choices().keep_in(folder);
    std::vector<Hit> hits(rays.size());
    tracer.trace(rays, hits, {});
    const auto all = tracer.choices().all();
    ASSERT_EQ(all.size(), 1u);
    EXPECT_LE(all[0].runs, run);
    EXPECT_TRUE(run < kRunsOfTrials || all[0].complete());
    EXPECT_GT(all[0].chosen().mrays_per_s, 0);
  }
  others.clear();
  fs::remove_all(folder);
}

TEST_F(Auto, TrialsGoOnOnceTheyCostLittleOfWhatWasTraced) {
  const auto rays = shapes::random_rays(kMany);
  trace(rays, {});
  Choices& choices = scene_->tracer->choices();
  Query query{.rays = scene_->tracer->ray_class(rays)};
  const auto tried = [&] { return std::ranges::count(choices.find(query)->candidates, true, &Candidate::tried); };
  const auto at_first = tried();
  trace(rays, {});
  EXPECT_EQ(tried(), at_first);  // too little was traced since
  const auto all = std::ptrdiff_t(choices.find(query)->candidates.size());
  for (int i = 0; i < 4 && tried() < all; ++i) {
    const auto before = tried();
    choices.note(query, std::size_t(1) << 40);
    trace(rays, {});
    EXPECT_GT(tried(), before);
  }
  ASSERT_TRUE(choices.find(query)->complete());
  EXPECT_EQ(choices.find(query)->runs, 1);
  EXPECT_LT(choices.find(query)->traced_s, 10);
  choices.note(query, std::size_t(1) << 40);
  EXPECT_FALSE(scene_->tracer->can_record(query, kMany));
  trace(rays, {});
  EXPECT_LT(choices.find(query)->traced_s, 10);       // the fastest have raced again,
  EXPECT_GT(choices.find(query)->since_entry_s, 10);  // which is no new candidate
  EXPECT_TRUE(choices.find(query)->complete());
  EXPECT_EQ(choices.find(query)->candidates.size(), candidates_for(query, gpu_->info()).size());
  expect_silent(*gpu_);
}

TEST_F(Auto, ACandidateIsPutOffUntilTheRaysPayForIt) {
  const auto rays = shapes::random_rays(kMany);
  trace(rays, {});
  Choices& choices = scene_->tracer->choices();
  const Query query{.rays = scene_->tracer->ray_class(rays)};
  const auto put_off = [&](double seconds, double mrays_per_s) {
    Choice choice = *choices.find(query);
    for (Candidate& c : choice.candidates) c.tried = true, c.put_off_s = 0;
    Candidate& last = choice.candidates.back();
    last.tried = false, last.put_off_s = seconds, last.mrays_per_s = 0;
    choice.candidates.front().mrays_per_s = mrays_per_s;
    choice.traced_s = choice.since_entry_s = 0;
    choices.add(choice);
  };
  const auto left = [&] { return std::ranges::count(choices.find(query)->candidates, false, &Candidate::tried); };
  put_off(5, 10);
  trace(rays, {});
  EXPECT_EQ(left(), 1);
  choices.note(query, std::size_t(1) << 40);
  trace(rays, {});
  EXPECT_EQ(left(), 0);
  EXPECT_LT(choices.find(query)->since_entry_s, 10);
  put_off(5, 1e-6);  // the batch by itself pays for it
  trace(rays, {});
  EXPECT_EQ(left(), 0);
  expect_silent(*gpu_);
}

TEST_F(Auto, KnobsThatOnlySlowCandidatesCanFollow) {
  const auto rays = shapes::random_rays(kMany);
  trace(rays, {.knobs = {{"fallback", "1"}}});
  const Choice* choice = choice_for(rays, {.knobs = {{"fallback", "1"}}});
  ASSERT_TRUE(choice);
  EXPECT_EQ(choice->chosen().method, "packet-wide");
  expect_silent(*gpu_);
}

TEST_F(Auto, AllAreTriedAtOnceForMeasurements) {
  scene_->tracer->choices().try_all = true;
  const auto rays = shapes::random_rays(kMany);
  trace(rays, {});
  EXPECT_TRUE(choice_for(rays, {})->complete());
  const auto changes = scene_->tracer->choices().changes();
  Buffer<Ray> other(*gpu_, kMany, Access::Storage, "other rays");
  other.upload(rays);
  Buffer<Hit> hits(*gpu_, rays.size(), Access::Storage, "hits");
  scene_->tracer->trace(other, hits, kMany, {});
  EXPECT_GT(scene_->tracer->choices().changes(), changes);  // the rays lie in another buffer
}

TEST(AutoSorts, WhatWasPutOffPaysOnceEnoughWasTraced) {
  Choice choice;
  choice.rays = "diffuse";
  choice.candidates = {{"while-while", {}, 5, true}};
  choice.since_entry_s = 100;
  EXPECT_TRUE(choice.complete());
  EXPECT_FALSE(choice.pays(choice.paid_s()));
  choice.candidates.push_back({"packet-wide", {}, 0, false, 6});
  EXPECT_TRUE(choice.complete());
  EXPECT_FALSE(choice.pays(choice.paid_s()));
  choice.since_entry_s = 130;
  EXPECT_TRUE(choice.pays(choice.paid_s()));
  choice.since_entry_s = 25;  // sooner for rays that packets suit
  EXPECT_FALSE(choice.pays(choice.paid_s()));
  choice.rays = "primary";
  EXPECT_TRUE(choice.pays(choice.paid_s()));
}

TEST(AutoSorts, CandidatesOnGpusAreNoTwins) {
  DeviceInfo gpu;
  gpu.type = VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU;
  gpu.shuffle = gpu.arithmetic = true;
  gpu.subgroup_size = gpu.min_subgroup_size = gpu.max_subgroup_size = gpu.max_group_subgroups = 32;
  gpu.max_group_invocations = gpu.max_group_size_x = 1024;
  gpu.max_group_count_x = 65535;
  const auto names = [&](const Query& query) {
    std::vector<std::string> all;
    for (const Candidate& c : candidates_for(query, gpu)) all.push_back(c.name());
    return all;
  };
  using Names = std::vector<std::string>;
  const Query any{.want = Want::Any};
  EXPECT_EQ(names({}), (Names{"while-while", "frontier", "dynamic-fetch", "bvh8", "if-if", "frontier frontier=32"}));
  EXPECT_EQ(names(any), (Names{"while-while", "frontier", "frontier sorted=0", "dynamic-fetch", "bvh8", "bvh8 sorted=0",
                               "if-if", "frontier frontier=32", "while-while sorted=0"}));
  EXPECT_EQ(names({.want = Want::Any, .knobs = {{"sorted", "0"}}}),
            (Names{"while-while sorted=0", "frontier sorted=0", "dynamic-fetch sorted=0", "bvh8 sorted=0",
                   "if-if sorted=0", "frontier frontier=32 sorted=0"}));
  EXPECT_EQ(names({.knobs = {{"frontier", "32"}}}), (Names{"frontier frontier=32"}));
  EXPECT_EQ(candidates_for({}, gpu, (1 << 22) - 1).size(), 6u);
  EXPECT_EQ(candidates_for({}, gpu, 1 << 22).size(), 8u);  // two that sort rays
  // Where leaves come in runs, they are also tried one at a time; in mode fast they never do.
  gpu.driver_id = VK_DRIVER_ID_NVIDIA_PROPRIETARY;
  EXPECT_EQ(names({}), (Names{"while-while", "frontier", "dynamic-fetch", "bvh8", "if-if", "frontier frontier=32",
                              "while-while leaf_run=0", "frontier leaf_run=0", "dynamic-fetch leaf_run=0"}));
  EXPECT_EQ(names({.numeric = "fast"}).size(), 6u);
  EXPECT_EQ(names({.knobs = {{"leaf_run", "0"}}}).size(), 6u);
}

TEST(AutoSorts, RaysAreToldByDirectionsAndLength) {
  const Bounds scene{glm::vec3(-1), glm::vec3(1)};
  std::vector<Ray> rays(640, {{0, 0, 0}, 0, {1, 2, 3}, 1e30f});
  EXPECT_EQ(ray_class_of(rays, scene), "foreign: coherent, long");
  for (Ray& r : rays) r.t_max = 0.01f;
  EXPECT_EQ(ray_class_of(rays, scene), "foreign: coherent, short");
  for (std::size_t i = 0; i < 640; i += 128) rays[i].dir.x = -1;
  EXPECT_EQ(ray_class_of(rays, scene), "foreign: mixed, short");
  for (std::size_t i = 0; i < 640; i += 64) rays[i].dir.x = -1;
  EXPECT_EQ(ray_class_of(rays, scene), "foreign: incoherent, short");
  for (std::size_t i = 0; i < 640; i += 64) rays[i].t_max = -1;  // directions of dead rays do not count
  EXPECT_EQ(ray_class_of(rays, scene), "foreign: coherent, short");
  EXPECT_EQ(ray_class_of({}, scene), "foreign: coherent, long");
}

}  // namespace
}  // namespace ballot
