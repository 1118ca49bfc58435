// Two levels: every method on a scene of instances. An instance's answer is, by definition, that of the object-space
// ray against its mesh (engine/tree/host/instance.h), so hits are compared, bit for bit, with traces of the single
// meshes.
#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/oracle/in_double.h"
#include "engine/oracle/oracle.h"
#include "tests/device/fixture.h"
#include "tests/device/forests.h"

namespace ballot {
namespace {

using namespace harness;
using namespace forests;

class Instances : public DeviceTest {
 protected:
  static std::unique_ptr<Tracer> tracer_of(Forest& forest) {
    auto tracer = std::make_unique<Tracer>(*gpu_, forest);
    tracer->prefill = kPattern;
    return tracer;
  }

  static std::vector<Hit> trace(Tracer& tracer, std::span<const Ray> rays, const Query& q) {
    std::vector<Hit> hits(rays.size());
    tracer.trace(rays, hits, q);
    EXPECT_EQ(count_untouched(hits), 0u) << tracer.variant(q).name();
    return hits;
  }

  /// The hits by the definition: the object-space rays of each instance are traced against its mesh alone.
  static std::vector<Hit> defined(const Forest& forest, std::span<const Ray> rays, const std::string& numeric) {
    std::vector<Hit> best(rays.size());
    for (std::size_t i = 0; i < rays.size(); ++i) best[i] = {INFINITY, NO_HIT, 0, 0};
    std::vector<std::unique_ptr<Tracer>> alone;  // one for each mesh, with kernels that suit all
    TreeFacts facts = forest.facts();
    facts.top_depth = 0;
    for (const MeshTree& mesh : forest.meshes())
      alone.push_back(std::make_unique<Tracer>(*gpu_, *mesh.bvh, mesh.triangles, facts));
    for (const Instance& instance : forest.instances()) {
      std::vector<Ray> moved(rays.size(), Ray{{0, 0, 0}, 0, {0, 0, 1}, 0});  // dead
      for (std::size_t i = 0; i < rays.size(); ++i)
        if (!is_dead(rays[i])) moved[i] = object_ray(rays[i], instance.map);
      std::vector<Hit> hits(rays.size());
      alone[instance.mesh]->trace(moved, hits, {.method = "while-while", .numeric = numeric});
      for (std::size_t i = 0; i < rays.size(); ++i) {
        if (hits[i].prim == NO_HIT) continue;
        const Hit h{hits[i].t * direction_scale(rays[i]), hits[i].prim + instance.first, hits[i].u, hits[i].v};
        if (best[i].prim == NO_HIT || h.t < best[i].t || (h.t == best[i].t && h.prim < best[i].prim)) best[i] = h;
      }
    }
    return best;
  }

  /// The same of mode double: rays are moved, and hits are compared, in double, and then rounded.
  static std::vector<Hit> defined_in_double(const Forest& forest, std::span<const Ray> rays) {
    std::vector<PairTree> trees;
    for (const MeshTree& mesh : forest.meshes())
      trees.push_back(encode_pairs(*mesh.bvh, mesh.triangles, NodeLayout::Interleaved));
    std::vector<Hit> found;
    for (const Ray& ray : rays) {
      OracleHit best{.prim = NO_HIT};
      for (const Instance& instance : forest.instances()) {
        if (is_dead(ray)) continue;
        const auto moved = [&](const glm::dvec3& v) {
          glm::dvec3 to;
          for (int i = 0; i < 3; ++i) {
            const glm::dvec3 row = instance.map.row[i];
            to[i] = row.x * v.x + row.y * v.y + row.z * v.z;
          }
          return to;
        };
        RayInDouble r = in_double(ray);
        r.origin = moved(r.origin - glm::dvec3(instance.map.translation));
        r.dir = moved(r.dir);
        OracleHit hit = OracleInDouble(trees[instance.mesh], forest.meshes()[instance.mesh].triangles, {}).nearest(r);
        if (hit.prim == NO_HIT) continue;
        hit.prim += instance.first;
        if (best.prim == NO_HIT || hit.t < best.t || (hit.t == best.t && hit.prim < best.prim)) best = hit;
      }
      const bool none = best.prim == NO_HIT;
      found.push_back(none ? Hit{INFINITY, NO_HIT, 0, 0}
                           : Hit{float(best.t) + 0.f, best.prim, float(best.u), float(best.v)});
    }
    return found;
  }
};

class InstanceMethods : public Instances {};

// In the conservative modes nearest hits are those of the definition, bit for bit. In every mode, and for any hits in
// the default one, they are right by the oracle. lavapipe compiles one kernel of mode exact alone: each takes it
// seconds.
TEST_F(InstanceMethods, FindWhatTheDefinitionSays) {
  Forest forest = make_forest(three_meshes(), twelve_instances());
  const Oracle oracle(forest);
  const auto tracer = tracer_of(forest);
  const std::vector<Ray> rays = rays_for(forest, 700);
  const std::vector<OracleHit> nearest = oracle.nearest(rays);
  for (const NumericMode& mode : modes_for(gpu_->info())) {
    std::vector<Hit> truth;
    for (const Want want : {Want::Nearest, Want::Any})
      for (const Query& q : every_instance_method(want, mode.name)) {
        if (want == Want::Any && mode.name != kDefaultNumeric) continue;
        if (mode.needs_float64 && gpu_->info().is_cpu() && q.method != kPlainestMethod) continue;
        const std::vector<Hit> hits = trace(*tracer, rays, q);
        const Judgement j = oracle.judge(rays, hits, nearest, want, judged_as(mode));
        EXPECT_EQ(j.errors(), 0u) << tracer->variant(q).name() << "\n  " << (j.examples.empty() ? "" : j.examples[0]);
        EXPECT_GT(std::ranges::count_if(hits, [](const Hit& h) { return h.prim != NO_HIT; }), 400);
        if (!mode.conservative || want == Want::Any) continue;
        const bool in_double = mode.triangle == TRIANGLE_DOUBLE;
        if (truth.empty())
          truth = in_double ? defined_in_double(forest, rays) : defined(forest, rays, std::string(mode.name));
        // A GPU's divisions in double may round otherwise.
        const std::size_t others =
            in_double && !gpu_->info().is_cpu() ? count_other_prims(truth, hits) : count_different(truth, hits);
        EXPECT_EQ(others, 0u) << tracer->variant(q).name();
      }
  }
}

TEST_F(Instances, IdentityTransformsHitAsTheFlatScene) {
  const std::vector<Placement> placements{{0, {}}, {1, {}}, {3, {}}, {2, {}}, {0, {}}};
  Forest forest = make_forest(three_meshes(), placements);
  shapes::Triangles flat;
  for (const Placement& p : placements)
    flat.insert(flat.end(), forest.meshes()[p.mesh].triangles.begin(), forest.meshes()[p.mesh].triangles.end());
  const auto one = make(*gpu_, flat, quick());
  const auto tracer = tracer_of(forest);
  const std::vector<Ray> rays = rays_for(forest, 2000);
  for (const char* method : {"while-while", "auto"}) {
    std::vector<Hit> expected(rays.size());
    one->tracer->trace(rays, expected, {.method = method});
    EXPECT_EQ(count_different(expected, trace(*tracer, rays, {.method = method})), 0u) << method;
  }
}

TEST_F(Instances, SceneWithoutAnyIsMissed) {
  const auto rays = shapes::random_rays(100);
  for (const std::vector<Placement>& placements :
       {std::vector<Placement>{}, std::vector<Placement>{{2, {}}, {2, {}}}}) {
    Forest forest = make_forest(three_meshes(), placements);
    const auto tracer = tracer_of(forest);
    for (const char* method : {"while-while", "frontier"})
      EXPECT_EQ(std::ranges::count(trace(*tracer, rays, {.method = method}), NO_HIT, &Hit::prim), 100) << method;
  }
  Forest none = make_forest({}, {});
  EXPECT_EQ(std::ranges::count(trace(*tracer_of(none), rays, {}), NO_HIT, &Hit::prim), 100);
}

TEST_F(Instances, MovedInstancesHitLikeNewOnes) {
  std::vector<Placement> placements = twelve_instances();
  Forest forest = make_forest(three_meshes(), placements);
  const auto tracer = tracer_of(forest);
  const std::vector<Ray> rays = rays_for(forest, 500);
  const auto before = trace(*tracer, rays, {});
  std::vector<Transform> transforms = forest.transforms();
  std::vector<Hit> after;
  const auto move = [&] {
    tracer->move_instances(transforms);
    for (std::size_t i = 0; i < placements.size(); ++i) placements[i].transform = transforms[i];
    Forest fresh = make_forest(three_meshes(), placements);
    after = trace(*tracer, rays, {});
    EXPECT_EQ(count_different(after, trace(*tracer_of(fresh), rays, {})), 0u);
    EXPECT_GT(count_different(after, before), 100u);
  };
  for (Transform& t : transforms) t.m[1][3] += 0.01f;  // refits the top level
  move();
  EXPECT_NE(forest.top().cost, forest.top().built_cost);
  std::rotate(transforms.begin(), transforms.begin() + 3, transforms.end());
  move();
  transforms[5].m[1][1] = NAN;
  EXPECT_THROW(tracer->move_instances(transforms), Error);
  EXPECT_EQ(count_different(after, trace(*tracer, rays, {})), 0u);
}

// Transforms near the limits, and rays from far away that graze what sticks out: no box may lose a hit.
TEST_F(Instances, BoxesLoseNoHitUnderExtremeTransforms) {
  const std::vector<Placement> placements{
      {0, turned(0.3f, 0.7f, glm::vec3(1e9f), {1e11f, 0, 0})},
      {0, turned(0.3f, 0.7f, glm::vec3(1e-9f), {0, 0, 0})},
      {0, turned(0.3f, 0.7f, {1, 1, 1e-6f}, {3, 0, 0})},
      {0, transform({1, 0, 0}, {1, 1e-4f, 0}, {0, 0, 1}, {-3, 0, 0})},  // a shear whose condition is 2e4
      {0, moved({1e6f, 1e6f, 0})},
      {5, turned(1, 1, glm::vec3(1), {-1e6f, 0, 0})}};  // its mesh lies at 1e6
  auto meshes = three_meshes();
  meshes.push_back(shapes::moved(shapes::sphere(2), {1e6f, 0, 0}));
  Forest forest = make_forest(std::move(meshes), placements);
  shapes::Random random(5);
  std::vector<Ray> rays;
  for (std::uint32_t k = 0; rays.size() < 3000; k = std::uint32_t((k + 1) % placements.size())) {
    const Instance& instance = forest.instances()[k];
    const std::size_t below = forest.meshes()[instance.mesh].triangles.size();
    const Triangle t = forest.triangle({k, std::uint32_t(random.below(below))});
    const float size = glm::length(instance.box.hi - instance.box.lo);
    glm::vec3 side = random.point(1);
    if (random.below(2)) side[int(random.below(3))] = 0;  // along a face of the box
    const glm::vec3 from = t[0] + side * size * std::pow(10.f, random.in(-1, 4));
    rays.push_back(shapes::towards(from, t[0] + (t[1] - t[0]) * (random.below(2) ? random.in(0, 1) : 0.f)));
  }
  const auto tracer = tracer_of(forest);
  for (const char* numeric : {"watertight", "exact"}) {
    if (find_numeric(numeric).needs_float64 && !is_first(gpu_->info())) continue;
    const auto truth = defined(forest, rays, numeric);
    EXPECT_GT(std::ranges::count_if(truth, [](const Hit& h) { return h.prim != NO_HIT; }), 1000);
    for (const std::string method : {"while-while", "packet"}) {
      if (find_numeric(numeric).needs_float64 && gpu_->info().is_cpu() && method != kPlainestMethod) continue;
      EXPECT_EQ(count_different(truth, trace(*tracer, rays, {.method = method, .numeric = numeric})), 0u)
          << method << ", " << numeric;
    }
  }
}

// Rays that need many exact decisions give up and are listed; rays after them, which may meet no instance, do not.
TEST_F(Instances, RaysThatGiveUpAreTracedAgain) {
  if (!gpu_->info().float64 || !is_first(gpu_->info())) return;
  const std::vector<Placement> placements{{0, {}}, {1, turned(0.5f, 0, glm::vec3(1), {4, 0, 0})}, {0, {}}};
  Forest forest = Forest({shapes::same_centroid(24), shapes::sphere(2)}, placements,
                         [](std::span<const Triangle> t) { return build_bvh(t); });
  shapes::Random random(92);
  std::vector<Ray> rays;
  for (int i = 0; i < 300; ++i) {
    const glm::vec3 from = random.point(2);
    rays.push_back({from, 0, -from, 1e30f});
    rays.push_back({from, 0, {0, i % 2 ? 1.f : 1e-3f, 40}, 1e30f});
    rays.push_back(shapes::towards(from, {4, 0, 0}));
  }
  const auto truth = defined(forest, rays, "exact");
  const auto tracer = tracer_of(forest);
  for (const char* method : {"while-while", "packet", "dynamic-fetch"}) {
    const Query q{.method = method, .numeric = "exact", .knobs = {{"doubtful", "limited"}}};
    EXPECT_EQ(count_different(truth, trace(*tracer, rays, q)), 0u) << tracer->variant(q).name();
  }
}

// As in Methods.WalksThatADriverCutsShortAreFinished.
TEST_F(Instances, WalksThatADriverCutsShortAreFinished) {
  if (!harness::at_default_size(gpu_->info())) return;
  const std::vector<Placement> placements{{0, {}}, {0, turned(0.2f, 0, glm::vec3(1), {0, 0, 0.1f})}, {1, {}}};
  Forest forest = Forest({shapes::identical(40000), shapes::sphere(2)}, placements,
                         [](std::span<const Triangle> t) { return build_bvh(t, {.max_leaf = 2, .split_budget = 0}); });
  const auto rays = shapes::random_rays(40);
  const auto tracer = tracer_of(forest);
  for (const char* method : {"while-while", "packet"})
    EXPECT_EQ(count_different(defined(forest, rays, "watertight"), trace(*tracer, rays, {.method = method})), 0u)
        << method;
}

TEST_F(Instances, MethodWithoutKernelsIsRefused) {
  Forest forest = make_forest(three_meshes(), twelve_instances());
  const auto tracer = tracer_of(forest);
  try {
    trace(*tracer, shapes::random_rays(1), {.method = "packet-wide"});
    FAIL();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("packet-wide: it has no kernel for scenes with instances; expected one of: "
                                         "packet, if-if"),
              std::string::npos)
        << e.what();
  }
}

}  // namespace
}  // namespace ballot
