// Tests that counters count what their names say, and that timed kernels contain no trace of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <numeric>

#include "engine/gpu/shader.h"
#include "tests/device/fixture.h"
#include "tests/temporary.h"

namespace ballot {
namespace {

using namespace harness;
namespace fs = std::filesystem;

class CounterTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    world_ = std::make_unique<DeviceScene>(load_scene(BALLOT_SOURCE_DIR "/scenes/cornell.gltf"),
                                           DeviceSceneOptions{.device = "", .validate = true, .build = {}});
    diffuse_ = world_->make_batch(world_->scene().views[0], find_ray_kind("diffuse"), 64, 64);
    primary_ = world_->make_batch(world_->scene().views[0], find_ray_kind("primary"), 64, 64);
  }
  static void TearDownTestSuite() {
    diffuse_.reset();
    primary_.reset();
    world_.reset();
  }
  void TearDown() override { EXPECT_EQ(world_->messages(), std::vector<std::string>{}); }

  static Counters count(const char* method, const Knobs& knobs = {}, RayBatch& batch = *diffuse_) {
    return world_->count(batch, {.method = method, .knobs = knobs});
  }
  static void expect_same(const Counters& a, const Counters& b, std::initializer_list<const char*> names) {
    for (const char* name : names) EXPECT_EQ(a[name], b[name]) << name;
  }

  static inline std::unique_ptr<DeviceScene> world_;
  static inline std::unique_ptr<RayBatch> diffuse_, primary_;
};

// Methods.AnyTwoSettingsTogetherAreRight counts in the other modes and with other knobs.
TEST_F(CounterTest, CountedWalksHitWhatTimedOnesHit) {
  for (const Query& q : every_method(Want::Nearest, kDefaultNumeric)) {
    world_->trace(*diffuse_, q);
    const auto timed = diffuse_->hits();
    const Counters c = world_->count(*diffuse_, q);
    EXPECT_EQ(count_different(timed, diffuse_->hits()), 0u) << q.method;
    EXPECT_EQ(c.rays, timed.size());
    EXPECT_GT(c["nodes"], 0u);
  }
}

// Each ray has its own record, as heat maps and the inspector show single rays.
TEST_F(CounterTest, EveryRayHasCountsOfItsOwn) {
  const std::vector<Ray> rays = primary_->rays();
  Context& gpu = *world_->context();
  Buffer<Ray> ray_buffer(gpu, rays.size(), Access::Storage, "rays");
  Buffer<Hit> hits(gpu, rays.size(), Access::Storage, "hits");
  Buffer<RayStats> stats(gpu, rays.size(), Access::Storage, "counters");
  ray_buffer.upload(rays);
  for (const Query& q : every_method(Want::Nearest, kDefaultNumeric)) {
    world_->tracer().trace_counted(ray_buffer, hits, std::uint32_t(rays.size()), q, stats);
    std::vector<RayStats> all(rays.size());
    stats.download(all);
    const auto idle = std::ranges::count_if(all, [](const RayStats& s) { return s.nodes == 0; });
    const auto dead = std::ranges::count_if(rays, [](const Ray& r) { return r.t_max <= r.t_min; });
    EXPECT_EQ(idle, dead) << q.method;
    for (const RayStats& s : all) {
      ASSERT_LE(s.nodes_needed, s.nodes) << q.method;
      ASSERT_LE(s.triangles_tested, s.triangles) << q.method;
    }
  }
}

TEST_F(CounterTest, RaysByThemselvesNeedAllThatTheyVisit) {
  for (const char* method : {"if-if", "while-while", "speculative", "dynamic-fetch"}) {
    const Counters c = count(method);
    EXPECT_EQ(c["nodes"], c["nodes_needed"]) << method;
    EXPECT_EQ(c["leaves"], c["leaves_needed"]) << method;
    for (const char* none : {"packet_nodes", "unneeded", "votes", "switches", "overflows"}) EXPECT_EQ(c[none], 0u);
    EXPECT_GT(c.active_lanes(), 0);
    EXPECT_LE(c.active_lanes(), 1);
    EXPECT_LE(c["triangles_tested"], c["triangles"]);
  }
  // These methods visit nodes in the same order, so their counts are equal.
  expect_same(count("if-if"), count("while-while"), {"nodes", "leaves", "triangles", "triangles_tested"});
  expect_same(count("while-while"), count("dynamic-fetch"), {"nodes", "leaves", "triangles", "triangles_tested"});
  expect_same(count("bvh4"), count("bvh4-turns"), {"nodes", "leaves", "triangles", "triangles_tested"});
}

TEST_F(CounterTest, PacketsVisitMoreThanTheirRaysNeed) {
  const Counters alone = count("if-if"), packet = count("packet");
  EXPECT_GT(packet["nodes"], alone["nodes"]);
  EXPECT_LT(packet["nodes_needed"], packet["nodes"]);
  EXPECT_EQ(packet["packet_nodes"], packet["nodes"]);
  EXPECT_GT(packet["disagreements"], 0u);
  EXPECT_LE(packet["disagreements"], packet["votes"]);
  EXPECT_LT(packet.coherence(), count("packet", {}, *primary_).coherence());
  EXPECT_LE(packet.stack, world_->bvh_stats().depth + 1);
}

// A hybrid whose threshold is never reached counts as the packet does. One whose threshold is always reached splits.
TEST_F(CounterTest, HybridsBecomePacketsAtTheEndOfTheirRange) {
  const Counters packet = count("packet");
  const auto all = {"nodes", "nodes_needed", "leaves", "triangles", "votes", "disagreements", "packet_nodes"};
  expect_same(packet, count("stack-max", {{"k", "255"}}), all);
  expect_same(packet, count("split-count", {{"n", "1000000"}}), all);
  expect_same(packet, count("cut", {{"f", "0"}}), all);
  expect_same(packet, count("alternate", {{"f", "0"}}), all);
  const Counters k0 = count("stack-max", {{"k", "0"}}), k3 = count("stack-max", {{"k", "3"}});
  EXPECT_GT(k0["switches"], 0u);
  EXPECT_LT(k0["packet_nodes"], k3["packet_nodes"]);
  EXPECT_LT(k0["switch_depth"] * k3["switches"], k3["switch_depth"] * k0["switches"]) << "mean depths";
  EXPECT_LT(count("split-count", {{"n", "0"}})["packet_nodes"], packet["packet_nodes"]);
  EXPECT_LT(count("alternate", {{"f", "1"}})["packet_nodes"], count("alternate", {{"f", "0.25"}})["packet_nodes"]);
}

// When a lane finds a nearer hit, nodes that wait on the shared stack may become useless. A ray by itself would skip
// them by distance.
TEST_F(CounterTest, PacketsVisitNodesOfNoUseToAnyLane) {
  const Counters packet = count("packet");
  EXPECT_GT(packet["unneeded"], 0u);
  EXPECT_EQ(packet["few"] > 0, packet.subgroup > 4) << "less than a quarter of four lanes is none";
  EXPECT_LT(packet["unneeded"] + packet["few"], packet["votes"]);
  EXPECT_LT(double(count("packet", {}, *primary_)["unneeded"]), double(packet["unneeded"]));
}

TEST_F(CounterTest, CutSwitchesAtEveryNodeThatItPutsAside) {
  EXPECT_EQ(count("cut", {{"f", "0"}})["switches"], 0u);
  const Counters some = count("cut", {{"f", "0.5"}}), all = count("cut", {{"f", "1"}});
  EXPECT_GT(some["switches"], 0u);
  EXPECT_LT(some["packet_nodes"], count("packet")["nodes"]);
  EXPECT_LT(all["switch_depth"] * some["switches"], some["switch_depth"] * all["switches"]) << "mean depths";
}

// The channels stats.* and the heat maps show the sums of the counters.
TEST_F(CounterTest, HeatMapsShowTheCounters) {
  const Counters expected = count("cut", {}, *primary_);
  RenderOptions options{.width = 64, .height = 64, .stats = true};
  options.query = {.method = "cut"};
  const auto channel = [](const Image& image, std::string_view name) {
    for (const Channel& c : image.channels)
      if (c.name == name) return c.floats;
    ADD_FAILURE() << "no channel " << name;
    return std::vector<float>(64 * 64);
  };
  const Image plain = world_->render(world_->scene().views[0], options);
  double nodes = 0, triangles = 0;
  for (const float x : channel(plain, "stats.nodes")) nodes += x;
  for (const float x : channel(plain, "stats.triangles")) triangles += x;
  EXPECT_EQ(nodes, double(expected["nodes"]));
  EXPECT_EQ(triangles, double(expected["triangles_tested"]));
  for (const float x : channel(plain, "stats.lanes")) EXPECT_LE(x, float(world_->device().subgroup_size));
  for (const float x : channel(plain, "stats.phase")) EXPECT_LE(x, 1.0f);
  options.stats = false;
  options.shading = "heat";
  for (const HeatKind& kind : kHeatKinds) {
    options.heat = kind.name;
    RenderTimes times;
    const Image heat = world_->render(world_->scene().views[0], options, &times);
    EXPECT_GT(times.heat_top, 0) << kind.name;
    EXPECT_EQ(channel(heat, "stats.nodes"), channel(plain, "stats.nodes")) << kind.name;
    const auto red = channel(heat, "R");
    EXPECT_LT(*std::ranges::min_element(red), *std::ranges::max_element(red)) << kind.name;
  }
  options.spp = 4;
  options.heat = "nodes";
  const auto mean = channel(world_->render(world_->scene().views[0], options), "stats.nodes");
  EXPECT_NEAR(std::accumulate(mean.begin(), mean.end(), 0.0), nodes, nodes * 0.1);
  options.heat = "warmth";
  EXPECT_THROW(world_->render(world_->scene().views[0], options), Error);
}

// Tests the rule that makes bounded lists safe: the packet walks nodes that do not fit, and the hits stay the same.
TEST_F(CounterTest, FullListsOverflowToThePacket) {
  world_->trace(*diffuse_, {.method = "if-if"});
  const auto expected = diffuse_->hits();
  std::uint64_t last = ~0ull;
  for (const char* list : {"1", "2", "4", "8", "64"}) {
    const Counters c = count("cut", {{"f", "1"}, {"list", list}, {"stack", "private"}});
    EXPECT_EQ(count_different(expected, diffuse_->hits()), 0u) << "list " << list;
    EXPECT_LE(c["overflows"], last) << "list " << list;
    EXPECT_TRUE(c["overflows"] > 0 || list[0] != '1');
    last = c["overflows"];
  }
  EXPECT_EQ(last, 0u) << "64 entries are enough here";
}

TEST_F(CounterTest, DynamicFetchRefillsIdleLanes) {
  const Knobs persistent{{"refetch", "1"}, {"lanes", "64"}, {"batches", "100000"}, {"launch", "persistent"}};
  EXPECT_GT(count("dynamic-fetch", persistent)["fetches"], diffuse_->count() / 2);
  EXPECT_EQ(count("dynamic-fetch", {{"launch", "plain"}})["fetches"], 0u);
  EXPECT_GT(count("dynamic-fetch", persistent).active_lanes(), count("while-while").active_lanes());
}

/// Copies the shaders to a folder, without any counting statement.
void copy_without_counters(const fs::path& copy) {
  fs::copy(BALLOT_SOURCE_DIR "/shaders", copy, fs::copy_options::recursive);
  const auto is_statement = [](const std::string& line) {
    const std::size_t first = line.find_first_not_of(' ');
    return first != std::string::npos && line.compare(first, 6, "COUNT_") == 0;
  };
  std::size_t removed = 0;
  for (const auto& entry : fs::recursive_directory_iterator(copy)) {
    if (!entry.is_regular_file()) continue;
    std::ifstream in(entry.path());
    std::string text;
    const bool counters = entry.path().filename() == "stats.glsl";
    for (std::string line; std::getline(in, line);) {
      const bool drop = counters || is_statement(line);
      removed += drop;
      if (!drop) text += line + "\n";
      EXPECT_TRUE(drop || line.find("COUNT_") == std::string::npos || line.find("LEAF_COUNT_") != std::string::npos ||
                  line.find("VOTE_COUNT") != std::string::npos || line.find("#define") != std::string::npos ||
                  line.find("//") == 0)
          << entry.path() << ": " << line;
    }
    in.close();
    std::ofstream(entry.path(), std::ios::trunc) << text;
  }
  EXPECT_GT(removed, 30u);
}

class TimedKernels : public CounterTest {};

TEST_F(TimedKernels, AreThoseOfSourcesWithoutCounters) {
  std::vector<std::pair<KernelSource, std::vector<std::uint32_t>>> compiled;
  for (const NumericMode& mode : kNumericModes)
    for (const Want want : {Want::Nearest, Want::Any})
      for (const Query& q : every_method(want, mode.name)) {
        if (mode.name != kDefaultNumeric && q.method != kPlainestMethod) continue;  // no mode counts by itself
        const KernelSource source =
            kernel_source(world_->tracer().variant(q), world_->device(), world_->features().tree);
        compiled.emplace_back(source, compile_shader(source.file, source.defines, false).words);
        const KernelSource counted =
            kernel_source(world_->tracer().variant(q, true), world_->device(), world_->features().tree);
        EXPECT_NE(compile_shader(counted.file, counted.defines, false).words, compiled.back().second);
      }
  const test::TemporaryFolder copy;
  copy_without_counters(copy.path());
  const test::Variable shaders("BALLOT_SHADERS", copy.path().string());
  for (const auto& [source, words] : compiled)
    EXPECT_TRUE(compile_shader(source.file, source.defines, false).words == words) << source.name;
}

}  // namespace
}  // namespace ballot
