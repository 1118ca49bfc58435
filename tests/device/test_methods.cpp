// Holds every registered traversal method to the CPU oracle: every method x vote x nearest or any hit x numeric mode,
// on every ray set of every scene. A new method or mode is tested as soon as it is registered.
#include <algorithm>
#include <set>

#include "engine/answer/repair.h"
#include "tests/device/fixture.h"
#include "tests/device/ray_sets.h"
#include "tests/device/scene_cases.h"

namespace ballot {
namespace {

using namespace harness;
using namespace scene_cases;

class Methods : public DeviceTest, public testing::WithParamInterface<SceneCase> {
 protected:
  static std::vector<Hit> trace(Traced& t, std::span<const Ray> rays, const Query& q) {
    std::vector<Hit> hits(rays.size());
    t.tracer->trace(rays, hits, q);
    EXPECT_EQ(count_untouched(hits), 0u) << t.tracer->variant(q).name();
    return hits;
  }
  /// Traces every set of rays for the scene with these methods, their votes and modes, for nearest and any hit, and
  /// holds the hits to the oracle. Sets of few rays are traced by themselves, the others together. Scenes with kernels
  /// of their own test the default mode; they share kernels where tests are fewer.
  static void expect_right(std::span<const NumericMode> modes, std::span<const Method> methods) {
    const bool own = GetParam().own_kernels && at_default_size(gpu_->info());
    const auto t = make(*gpu_, GetParam().make(), {}, own ? Facts::OfThisTree : Facts::OfMostTrees);
    std::vector<shapes::RaySet> batches{{"all sets", {}}};
    for (shapes::RaySet& set : shapes::ray_sets(t->triangles, t->bvh))
      if (set.rays.size() < 8)
        batches.push_back(std::move(set));
      else
        batches[0].rays.insert(batches[0].rays.end(), set.rays.begin(), set.rays.end());
    for (const shapes::RaySet& set : batches) {
      const auto truth = t->oracle->nearest(set.rays);
      for (const NumericMode& mode : modes) {
        if (own && mode.name != kDefaultNumeric) continue;
        std::vector<Hit> first;
        for (const Want want : {Want::Nearest, Want::Any})
          for (const Query& q : every_method(want, mode.name)) {
            if (!find_row(methods, q.method)) continue;
            const auto hits = trace(*t, set.rays, q);
            const Judgement j = t->oracle->judge(set.rays, hits, truth, want, judged_as(mode));
            EXPECT_EQ(j.errors(), 0u) << set.name << ", " << t->tracer->variant(q).name() << "\n  "
                                      << (j.examples.empty() ? "" : j.examples[0]);
            if (!mode.conservative || want == Want::Any) continue;
            if (first.empty()) first = hits;
            EXPECT_EQ(count_different(first, hits), 0u) << set.name << ", bits, " << t->tracer->variant(q).name();
          }
      }
    }
  }

  /// As trace(), with the kernel that counts.
  static std::vector<Hit> counted(Traced& t, std::span<const Ray> rays, const Query& q) {
    Buffer<Ray> given(*gpu_, rays.size(), Access::Storage, "rays");
    Buffer<Hit> hits(*gpu_, rays.size(), Access::Storage, "hits");
    Buffer<RayStats> stats(*gpu_, rays.size(), Access::Storage, "counters");
    given.upload(rays);
    t.tracer->trace_counted(given, hits, std::uint32_t(rays.size()), q, stats);
    std::vector<Hit> all(rays.size());
    hits.download(std::span(all));
    return all;
  }
};

TEST_P(Methods, FindsWhatTheOracleFinds) {
  std::vector<NumericMode> modes = modes_for(gpu_->info());
  std::erase_if(modes, [](const NumericMode& m) { return m.needs_float64; });
  expect_right(modes, kMethods);
}

// In the modes whose kernels take long to compile, which lavapipe need not optimise. Scene `soup` tests all methods in
// mode exact; suite DoubleMode does so in mode double. Suite ExactMode holds some to the exact oracle.
class ExactMethods : public Methods {};

TEST_P(ExactMethods, FindWhatTheOracleFinds) {
  std::vector<NumericMode> modes = modes_for(gpu_->info());
  std::erase_if(modes, [](const NumericMode& m) { return !m.needs_float64; });
  const std::span one(&find_method(kDefaultMethod), 1);
  for (const NumericMode& mode : modes) {
    const bool all = GetParam().name == std::string_view("soup") && mode.name == "exact";
    expect_right({&mode, 1}, all ? std::span<const Method>(kMethods) : one);
  }
}

// Every knob's values meet those of every other, every method, mode and vote, sizes of workgroups and subgroups,
// nearest and any hit, and counters: each pair in some kernel, which is held to the oracle on several scenes.
TEST_F(Methods, AnyTwoSettingsTogetherAreRight) {
  struct Held {
    std::unique_ptr<Traced> scene;
    std::vector<Ray> rays;
    std::vector<OracleHit> truth;
    std::map<std::string, std::pair<std::string, std::vector<Hit>>> first;  // by mode and products, which round
  };
  std::vector<Held> all;
  for (const char* name : {"soup", "hugeAndTiny"}) {
    Held held;
    held.scene = make(*gpu_, std::ranges::find(kScenes, name, &SceneCase::name)->make());
    for (const shapes::RaySet& set : shapes::ray_sets(held.scene->triangles, held.scene->bvh))
      for (std::size_t i = 0; i < set.rays.size(); i += 5) held.rays.push_back(set.rays[i]);
    held.truth = held.scene->oracle->nearest(held.rays);
    all.push_back(std::move(held));
  }
  std::size_t dealt = 0;
  for (const CoveringKernel& k : any_two_settings(kMethods, gpu_->info())) {
    if (!is_dealt(gpu_->info(), dealt++)) continue;
    const NumericMode& mode = *k.variant.numeric;
    for (Held& held : all) {
      const std::string name = held.scene->tracer->variant(k.query).name();
      const auto hits =
          k.variant.counters ? counted(*held.scene, held.rays, k.query) : trace(*held.scene, held.rays, k.query);
      const Judgement j = held.scene->oracle->judge(held.rays, hits, held.truth, k.query.want, judged_as(mode));
      EXPECT_EQ(j.errors(), 0u) << name << "\n  " << (j.examples.empty() ? "" : j.examples[0]);
      if (!mode.conservative || k.query.want == Want::Any) continue;
      const std::string alike =
          fmt::format("{} {}", mode.name, int(held.scene->tracer->variant(k.query).config.products));
      const auto& [other, first] = held.first.emplace(alike, std::pair(name, hits)).first->second;
      EXPECT_EQ(count_different(first, hits), 0u) << "bits, " << name << " and " << other;
    }
  }
}

TEST_F(Methods, AnswersDoNotDependOnTheOrderOfRays) {
  const auto t = make(*gpu_, shapes::soup(3000, 0.1f));
  std::vector<Ray> rays;
  for (const shapes::RaySet& set : shapes::ray_sets(t->triangles, t->bvh))
    rays.insert(rays.end(), set.rays.begin(), set.rays.end());
  const auto first = trace(*t, rays, {.method = "if-if"});
  const auto order = scatter_order(rays.size());
  std::vector<Ray> shuffled(rays.size());
  for (std::size_t i = 0; i < rays.size(); ++i) shuffled[i] = rays[order[i]];
  for (const Method& m : kMethods) {
    const auto hits = trace(*t, shuffled, {.method = std::string(m.name)});
    std::vector<Hit> back(hits.size());
    for (std::size_t i = 0; i < hits.size(); ++i) back[order[i]] = hits[i];
    EXPECT_EQ(count_different(first, back), 0u) << m.name;
  }
}

// A threshold decides where a hybrid changes from packet to single rays, or when lanes get new rays. It must change the
// speed alone.
TEST_F(Methods, AnswersDoNotDependOnThresholds) {
  const auto t = make(*gpu_, shapes::soup(3000, 0.1f));
  auto rays = shapes::random_rays(1511);
  for (const Ray& r : shapes::morton_primary(t->bvh.bounds)) rays.push_back(r);
  const auto truth = t->oracle->nearest(rays);
  const auto first = trace(*t, rays, {.method = "if-if"});
  for (const Method& m : kMethods)
    for (const Knobs& threshold : every_threshold(m))
      for (const Knobs& vote : votes_of(m)) {
        Knobs knobs = threshold;
        knobs.insert(vote.begin(), vote.end());
        const Query nearest{.method = std::string(m.name), .knobs = knobs};
        EXPECT_EQ(count_different(first, trace(*t, rays, nearest)), 0u) << t->tracer->variant(nearest).name();
        const Query any{.want = Want::Any, .method = std::string(m.name), .knobs = knobs};
        EXPECT_EQ(t->oracle->judge(rays, trace(*t, rays, any), truth, Want::Any).errors(), 0u)
            << t->tracer->variant(any).name();
      }
}

// Rays that end exactly at the hit of a longer ray still find that hit. Rays of different lengths lie together.
TEST_F(Methods, RaysThatEndAtTheirHitFindIt) {
  for (const glm::vec3& moved : {glm::vec3(0), glm::vec3(300, -7, 20)}) {
    shapes::Triangles triangles = shapes::soup(3000, 0.1f);
    for (Triangle& s : triangles)
      for (glm::vec3& v : s) v += moved;
    const auto t = make(*gpu_, triangles);
    std::vector<Ray> rays = shapes::morton_primary(t->bvh.bounds);
    const auto hits = trace(*t, rays, {.method = "if-if"});
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (hits[i].prim == NO_HIT) continue;
      const float from = i / 64 % 2 ? 0.9f : 0.0f;  // some rays begin close to their end
      rays[i].t_min = hits[i].t * from;
      rays[i].t_max = hits[i].t;
    }
    const auto first = trace(*t, rays, {.method = "if-if"});
    EXPECT_EQ(std::ranges::count(first, NO_HIT, &Hit::prim), std::ranges::count(hits, NO_HIT, &Hit::prim));
    for (const Method& m : kMethods) {
      const Query query{.method = std::string(m.name)};
      EXPECT_EQ(count_different(first, trace(*t, rays, query)), 0u) << m.name;
      const auto any = trace(*t, rays, {.want = Want::Any, .method = query.method});
      EXPECT_EQ(std::ranges::count(any, NO_HIT, &Hit::prim), std::ranges::count(hits, NO_HIT, &Hit::prim)) << m.name;
    }
  }
}

// In the conservative modes hits do not depend on the tree: with or without spatial splits, with large or small leaves.
TEST_P(Methods, OtherTreesHitTheSame) {
  const auto base = make(*gpu_, GetParam().make());
  std::vector<Ray> rays;
  for (const shapes::RaySet& set : shapes::ray_sets(base->triangles, base->bvh))
    rays.insert(rays.end(), set.rays.begin(), set.rays.end());
  for (const NumericMode& mode : kNumericModes) {
    if (!mode.conservative) continue;
    const Query q{.numeric = std::string(mode.name)};
    const auto first = trace(*base, rays, q);
    for (const BuildSettings& settings :
         {BuildSettings{.split_budget = 0}, BuildSettings{.max_leaf = 1}, BuildSettings{.split_budget = 4}}) {
      const auto other = make(*gpu_, base->triangles, settings);
      EXPECT_EQ(count_different(first, trace(*other, rays, q)), 0u)
          << mode.name << ", leaves of at most " << settings.max_leaf << ", split budget " << settings.split_budget;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, Methods, testing::ValuesIn(kScenes), [](const auto& p) { return p.param.name; });
INSTANTIATE_TEST_SUITE_P(Scenes, ExactMethods, testing::ValuesIn(kScenes), [](const auto& p) { return p.param.name; });

struct ClosedMesh {
  const char* name;
  int levels;
  float scale;  // a power of two, so that rays and vertices scale exactly
};

void PrintTo(const ClosedMesh& mesh, std::ostream* out) { *out << mesh.name; }

class Leaks : public DeviceTest, public testing::WithParamInterface<ClosedMesh> {};

// Every ray from inside a closed mesh must hit, also where it is aimed at vertices and edges.
TEST_P(Leaks, WatertightHasNone) {
  Context& gpu = *gpu_;
  shapes::Triangles mesh = shapes::sphere(GetParam().levels);
  // The arithmetic of a ray does not depend on the subgroup size, so the others see a part of the rays.
  const bool every = at_default_size(gpu.info());
  auto rays = shapes::edge_rays(mesh, every ? 20011 : 5003, {0.01f, 0.02f, -0.015f});
  for (Triangle& t : mesh)
    for (glm::vec3& v : t) v *= GetParam().scale;
  for (Ray& r : rays) r.origin *= GetParam().scale, r.dir *= GetParam().scale;
  const auto t = make(gpu, mesh);
  for (const Method& m : kMethods)
    for (const Want want : {Want::Nearest, Want::Any}) {
      for (const Knobs& knobs : together_too(m)) {
        std::vector<Hit> hits(rays.size());
        t->tracer->trace(rays, hits, {want, std::string(m.name), "watertight", knobs});
        EXPECT_EQ(std::ranges::count_if(hits, [](const Hit& h) { return h.prim == NO_HIT; }), 0) << m.name;
      }
    }
}

INSTANTIATE_TEST_SUITE_P(ClosedMeshes, Leaks,
                         testing::Values(ClosedMesh{"unit", 6, 1}, ClosedMesh{"coarse", 1, 1},
                                         ClosedMesh{"tiny", 5, 0x1p-20f}, ClosedMesh{"large", 5, 0x1p20f}),
                         [](const auto& p) { return p.param.name; });

// Rays from the centre of a mesh that lies far from the origin must all hit. The centre is rounded to float32.
TEST_F(Methods, FarFromTheOriginNothingLeaks) {
  const glm::vec3 centre(148376, 1234, -223423);  // as in Embree's verify
  shapes::Triangles mesh = shapes::sphere(5);
  for (Triangle& s : mesh)
    for (glm::vec3& v : s) v = v * 10.f + centre;
  const auto t = make(*gpu_, mesh);
  shapes::Random random(3);
  std::vector<Ray> rays;
  for (int i = 0; i < 20001; ++i) {
    const Triangle& s = t->triangles[random.below(t->triangles.size())];
    const glm::vec3 target = random.below(2) ? s[0] : s[0] + (s[1] - s[0]) * random.in(0, 1);
    rays.push_back({centre, 0, target - centre, 1e30f});
  }
  for (const Method& m : kMethods)
    for (const Knobs& knobs : together_too(m)) {
      const auto hits = trace(*t, rays, {Want::Nearest, std::string(m.name), "watertight", knobs});
      EXPECT_EQ(std::ranges::count_if(hits, [](const Hit& h) { return h.prim == NO_HIT; }), 0) << m.name;
    }
}

// Mesa 22.3's lavapipe stops all loops of an invocation after 65 535 iterations. 40 000 triangles in one place need
// more.
TEST_F(Methods, WalksThatADriverCutsShortAreFinished) {
  const auto t = make(*gpu_, shapes::identical(40000), {.max_leaf = 2, .split_budget = 0});
  const auto rays = shapes::random_rays(97);
  const auto truth = t->oracle->nearest(rays);
  std::uint64_t retraced = 0;
  for (const Want want : {Want::Nearest, Want::Any})
    for (const Query& q : every_method(want, "watertight")) {
      std::vector<Hit> hits(rays.size());
      retraced += t->tracer->trace(rays, hits, q).retraced;
      EXPECT_EQ(t->oracle->judge(rays, hits, truth, q.want).errors(), 0u) << q.method;
    }
  const bool cuts = gpu_->info().known_driver() == Driver::Llvmpipe && gpu_->info().mesa_version() < 230000;
  EXPECT_EQ(retraced > 0, cuts) << retraced << " rays retraced on " << gpu_->info().driver;
}

TEST_F(Methods, PiecesHoldEveryLeafOnce) {
  const auto t = make(*gpu_, shapes::soup(3000, 0.2f));
  for (const NodeLayout layout : {NodeLayout::Interleaved, NodeLayout::Paper}) {
    const PairTree& bvh = t->tracer->pair_tree(layout);
    EXPECT_EQ(pieces_of(bvh, ~0ull).size(), 1u);
    const auto leaves = pieces_of(bvh, 0);
    EXPECT_EQ(leaves.size(), t->bvh.stats.leaves);
    EXPECT_EQ(std::set<std::uint32_t>(leaves.begin(), leaves.end()).size(), leaves.size());
    const auto some = pieces_of(bvh, 500);
    EXPECT_GT(some.size(), 5u);
    EXPECT_LT(some.size(), leaves.size());
  }
}

}  // namespace
}  // namespace ballot
