// Runs the hard-case suite (tools/hard) at its small size, in every numeric mode, on methods of each family: packets
// that share a path, rays that traverse alone, packets that split into single rays, and lanes that fetch new rays.
#include <algorithm>
#include <cmath>

#include "engine/answer/query_judge.h"
#include "engine/oracle/errors.h"
#include "engine/tree/host/padding.h"
#include "tests/device/crossing_test.h"
#include "tools/hard/hard.h"

namespace ballot {

std::ostream& operator<<(std::ostream& out, const HardCase& hard) { return out << hard.name << ": " << hard.what; }

namespace {

using namespace harness;

constexpr std::size_t kShown = 1000;  // wrong answers that are described; the first one beyond its bound is printed

class HardCases : public DeviceTest, public testing::WithParamInterface<HardCase> {
 protected:
  /// Returns queries for methods of each family. There are fewer for modes that are not conservative, as these do not
  /// promise equal answers of all methods, and for modes whose kernels take long to compile. DoubleMode holds every
  /// method of mode double to the bits of one oracle, so one and packets of many rays stand for all.
  static std::vector<Query> queries(Want want, const NumericMode& mode, const Bounds& scene) {
    std::vector<Query> all;
    const char* const methods[] = {"while-while", "packet", "speculative", "cut", "dynamic-fetch"};
    const bool alike = mode.triangle == TRIANGLE_DOUBLE && gpu_->info().is_cpu();
    for (const char* method : std::span(methods).first(!mode.conservative || alike ? 1 : mode.needs_float64 ? 3 : 5)) {
      all.push_back({want, method, std::string(mode.name), {}});
      if (find_method(method).packet()) all.back().knobs = {{"vote", "count"}};
    }
    all.push_back({want, "packet-wide", std::string(mode.name), kNoFallback});
    if (mode.conservative && !mode.needs_float64 && padded_reach(scene) > 0)
      for (const char* method : {"while-while", "frontier"})
        all.push_back({want, method, std::string(mode.name), {{"padding", "tree"}}});
    return all;
  }

  /// Traces and expects that every hit is written.
  static std::vector<Hit> trace(Traced& t, std::span<const Ray> rays, const Query& query) {
    std::vector<Hit> hits(rays.size());
    t.tracer->trace(rays, hits, query);
    EXPECT_EQ(count_untouched(hits), 0u) << t.tracer->variant(query).name();
    return hits;
  }

  static std::string in_words(const Ray& r, const Hit& h) {
    return fmt::format("ray ({} {} {}, t_min {}, direction {} {} {}, t_max {}): prim {} at t {}", r.origin.x,
                       r.origin.y, r.origin.z, r.t_min, r.dir.x, r.dir.y, r.dir.z, r.t_max, int(h.prim), h.t);
  }

  /// Expects that wrong(i) holds for no answer; else shows the number of such answers and the first.
  template <class Wrong>
  static void expect_none(const HardRays& set, std::span<const Hit> hits, const std::string& what, const Wrong& wrong) {
    std::size_t count = 0, first = 0;
    for (std::size_t i = hits.size(); i-- > 0;)
      if (wrong(i)) ++count, first = i;
    EXPECT_EQ(count, 0u) << "of " << hits.size() << " rays, " << what
                         << (count ? "\n  " + in_words(set.rays[first], hits[first]) : "");
  }

  /// Expects that the known answers and the closedness that a set claims are what the exact oracle finds.
  static void expect_honest(const HardRays& set, std::span<const ExactHit> truth) {
    for (std::size_t i = 0; i < truth.size(); ++i) {
      const bool known = set.answers.empty() || set.answers[i] == truth[i].prim ||
                         (set.answers[i] == kSomePrim && truth[i].prim != NO_HIT);
      ASSERT_TRUE(known) << set.name << ", answer " << int(set.answers[i]) << " of ray " << i
                         << " is not the exact one; "
                         << in_words(set.rays[i], {float(truth[i].t), truth[i].prim, 0, 0});
      ASSERT_TRUE(!set.closed || truth[i].prim != NO_HIT) << set.name << ", ray " << i << " meets nothing";
    }
  }

  /// Describes the first wrong answer beyond its bound, on a line of its own; empty if there is none.
  static std::string first_beyond(const ErrorFigures& figures) {
    for (const ErrorCase& c : figures.cases)
      if (!c.within_bound) return "\n  " + ballot::in_words(c);
    return "";
  }

  /// Traces the rays in another order and expects the same hits. The rays of a subgroup are then others, so packets
  /// take other paths.
  static void expect_same_in_other_order(Traced& t, const HardRays& set, std::span<const Hit> hits,
                                         const Query& query) {
    const auto order = scatter_order(set.rays.size());
    std::vector<Ray> shuffled(order.size());
    for (std::size_t i = 0; i < order.size(); ++i) shuffled[i] = set.rays[order[i]];
    const auto moved = trace(t, shuffled, query);
    std::vector<Hit> back(moved.size());
    for (std::size_t i = 0; i < order.size(); ++i) back[order[i]] = moved[i];
    EXPECT_EQ(count_different(hits, back), 0u) << set.name << ", in another order, " << t.tracer->variant(query).name();
  }

  /// Expects the known answers of a set, if it has any.
  static void expect_answers(const HardRays& set, std::span<const Hit> hits, const std::string& which) {
    if (set.answers.empty()) return;
    ASSERT_EQ(set.answers.size(), set.rays.size()) << which;
    expect_none(set, hits, which + ", not the known answer", [&](std::size_t i) {
      const bool any = set.want == Want::Any || set.answers[i] == kSomePrim;
      if (set.answers[i] != NO_HIT && any) return hits[i].prim == NO_HIT;
      return hits[i].prim != set.answers[i];
    });
  }
};

TEST_P(HardCases, Hold) {
  const HardCase& hard = GetParam();
  const HardScene made = hard.make(true);
  const auto t = make(*gpu_, made.scene.triangles, made.build);
  const ExactOracle exact(t->tracer->pair_tree(NodeLayout::Interleaved), t->triangles);
  EXPECT_TRUE(exact.lost().empty()) << "triangle " << exact.lost().front() << " has an area, but is in no leaf";
  for (const HardRays& set : made.rays) {
    const auto truth = exact.nearest(set.rays);
    expect_honest(set, truth);
    for (const NumericMode& mode : kNumericModes) {
      std::vector<Hit> first;
      std::vector<std::vector<Hit>> judged;  // most methods answer alike
      for (const Query& query : queries(set.want, mode, t->bvh.bounds)) {
        const std::string which = fmt::format("{}, {}, {}", hard.name, set.name, t->tracer->variant(query).name());
        const auto hits = trace(*t, set.rays, query);
        expect_answers(set, hits, which);
        const bool known = std::ranges::any_of(judged, [&](const auto& j) { return count_different(hits, j) == 0; });
        if (!mode.conservative || known) continue;
        judged.push_back(hits);
        const ErrorFigures f =
            error_figures(exact, *t->oracle, set.rays, hits, truth, set.want, mode.arithmetic, kShown);
        const bool none_allowed = mode.arithmetic == Arithmetic::Exact;
        EXPECT_EQ(none_allowed ? f.errors() + f.ties : f.beyond_bound + f.wrong_values, 0u)
            << "of " << f.rays << " rays, " << which << ": " << f.false_misses << " false misses, " << f.false_hits
            << " false hits, " << f.wrong_prims << " wrong prims, " << f.wrong_values << " wrong values, " << f.ties
            << " ties; " << f.within_bound << " within the bound" << first_beyond(f);
        if (set.closed)
          expect_none(set, hits, which + ", leaks", [&](std::size_t i) { return hits[i].prim == NO_HIT; });
        if (set.want == Want::Any) continue;
        if (first.empty()) {
          first = hits;
          expect_same_in_other_order(*t, set, hits, query);
        }
        expect_none(set, hits, which + ", other bits than the first method's",
                    [&](std::size_t i) { return std::memcmp(&hits[i], &first[i], sizeof(Hit)) != 0; });
      }
    }
  }
}

// Numbers of crossings, lists and first crossings: those of exact arithmetic in mode exact, else within their bounds.
TEST_P(HardCases, CrossingsHold) {
  const HardScene made = GetParam().make(true);
  const auto t = make(*gpu_, made.scene.triangles, made.build);
  RayQueries queries(*gpu_, t->tracer->tree());
  const QueryJudge judge(t->tracer->tree());
  for (const HardRays& set : made.rays)
    for (const bool exact : {false, true}) {
      RayAnswers found{.counts = CrossingTest::counts(queries, set.rays, {.exact = exact}),
                       .lists = CrossingTest::listed(queries, set.rays, {.exact = exact}),
                       .first = CrossingTest::listed(queries, set.rays, {.most = 3, .exact = exact}),
                       .most = 3};
      const RayErrors errors = judge.rays(set.rays, found);
      for (const QueryErrors& e : {errors.counts, errors.lists, errors.first}) {
        EXPECT_EQ(e.checked, set.rays.size());
        EXPECT_EQ(e.beyond, 0u) << GetParam().name << ", " << set.name << (exact ? ", exact" : "");
        EXPECT_TRUE(!exact || e.wrong == 0) << GetParam().name << ", " << set.name << ": " << e.wrong << " wrong";
      }
    }
}

// A case has a description, is generated identically each time, and has no dead ray where it claims a closed mesh.
// A leak of a mesh with zero-area triangles would not be the traversal's fault.
TEST_P(HardCases, AreAsTheySay) {
  const HardScene made = GetParam().make(true);
  EXPECT_FALSE(GetParam().from.empty() || GetParam().what.empty());
  EXPECT_FALSE(made.rays.empty());
  const HardScene again = GetParam().make(true);
  ASSERT_EQ(again.rays.size(), made.rays.size());
  for (std::size_t s = 0; s < made.rays.size(); ++s) {
    const HardRays &a = made.rays[s], &b = again.rays[s];
    EXPECT_FALSE(a.rays.empty()) << a.name;
    EXPECT_EQ(std::memcmp(a.rays.data(), b.rays.data(), a.rays.size() * sizeof(Ray)), 0) << a.name;
    const auto dead = std::ranges::count_if(a.rays, [](const Ray& r) { return is_dead(r); });
    EXPECT_TRUE(!a.closed || dead == 0) << a.name;
  }
}

std::vector<HardCase> cases() { return {hard_cases().begin(), hard_cases().end()}; }

std::string test_name(const testing::TestParamInfo<HardCase>& info) {
  std::string name(info.param.name);
  std::ranges::replace(name, '-', '_');
  return name;
}

INSTANTIATE_TEST_SUITE_P(Hard, HardCases, testing::ValuesIn(cases()), test_name);

/// A tree that is a single chain, deeper than any that the builder makes. Each level has one triangle, and each
/// triangle lies within the next.
struct Chain {
  UnsetVector<Triangle> triangles;
  Bvh bvh;
};

Chain chain_of(std::uint32_t levels) {
  Chain c;
  for (std::uint32_t i = 0; i <= levels; ++i) {
    const float size = std::ldexp(i % 2 ? 1.5f : 1.f, int(i / 2) - 100);
    c.triangles.push_back({{{size, -size, i % 3 ? size : -size}, {-size, size, size}, {-size, 0.5f * size, -size}}});
  }
  c.bvh.nodes.resize(2 + 2 * levels);
  const auto box = [&](BvhNode& node, std::uint32_t from, std::uint32_t to) {
    node.lo = node.hi = c.triangles[to][0];
    for (std::uint32_t i = from; i <= to; ++i)
      for (const glm::vec3& v : c.triangles[i]) node.lo = glm::min(node.lo, v), node.hi = glm::max(node.hi, v);
  };
  std::uint32_t inner = 0;
  for (std::uint32_t i = levels; i > 0; --i) {  // the largest triangle is the root's left child
    const std::uint32_t left = 2 + 2 * (levels - i);
    box(c.bvh.nodes[inner], 0, i);
    c.bvh.nodes[inner].count = 0;
    c.bvh.nodes[inner].first = left;
    box(c.bvh.nodes[left], i, i);
    c.bvh.nodes[left].count = 1;
    c.bvh.nodes[left].first = levels - i;
    c.bvh.references.push_back(i);
    inner = left + 1;
  }
  box(c.bvh.nodes[inner], 0, 0);
  c.bvh.nodes[inner].count = 1;
  c.bvh.nodes[inner].first = levels;
  c.bvh.references.push_back(0);
  c.bvh.bounds = {c.bvh.nodes[0].lo, c.bvh.nodes[0].hi};
  c.bvh.stats.depth = levels;
  return c;
}

TEST_F(HardCases, AChainOf256Levels) {
  const Chain c = chain_of(256);
  Tracer tracer(*gpu_, c.bvh, c.triangles, facts_of(c.bvh));
  tracer.prefill = kPattern;
  const ExactOracle exact(tracer.pair_tree(NodeLayout::Interleaved));
  const Oracle bound(tracer.pair_tree(NodeLayout::Interleaved));
  std::vector<Ray> rays;
  for (std::uint32_t i = 0; i < 500; ++i) {  // from a triangle of one scale to one of another, outwards and inwards
    const Triangle& from = c.triangles[i * 37 % 257];
    const Triangle& to = c.triangles[i * 101 % 257];
    const glm::vec3 target = (to[0] + to[1] + to[2]) / 3.f, start = from[i % 3] * 0.75f;
    if (target != start) rays.push_back({start, 0, target - start, 1e30f});
  }
  const auto truth = exact.nearest(rays);
  for (const Method& method : kMethods) {
    Query query{.method = std::string(method.name)};
    if (method.own_stack || method.chooses)
      query.knobs = {{"stack", "private"}};  // shared memory cannot hold a stack for so many levels
    std::vector<Hit> hits(rays.size());
    tracer.trace(rays, hits, query);
    EXPECT_EQ(count_untouched(hits), 0u) << tracer.variant(query).name();
    const ErrorFigures f =
        error_figures(exact, bound, rays, hits, truth, Want::Nearest, find_numeric(query.numeric).arithmetic, kShown);
    EXPECT_EQ(f.beyond_bound + f.wrong_values, 0u) << tracer.variant(query).name() << first_beyond(f);
  }
}

TEST(HardRefusals, AreErrorsThatName) {
  for (const HardRefusal& refusal : hard_refusals()) {
    Scene scene = refusal.make();
    std::string text;
    try {
      finish_scene(scene);
      build_bvh(scene.triangles);
    } catch (const Error& error) {
      text = error.what();
    }
    EXPECT_NE(text.find(refusal.says), std::string::npos) << refusal.name << ": " << text;
    EXPECT_NE(text.find("triangle 3"), std::string::npos) << refusal.name << ": " << text;
  }
}

}  // namespace
}  // namespace ballot
