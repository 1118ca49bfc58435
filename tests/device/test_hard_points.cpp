// Runs the hard cases of points, and hard points on the scenes of all hard cases, at their small size in both modes of
// point queries. The exact oracles judge all answers; exact arithmetic over all triangles judges some of the oracles'.
#include <algorithm>
#include <cstddef>
#include <cstring>
#include <functional>
#include <glm/vector_relational.hpp>

#include "engine/answer/query_judge.h"
#include "engine/oracle/closest.h"
#include "engine/oracle/crossings.h"
#include "engine/oracle/nearest.h"
#include "engine/tree/host/build.h"
#include "engine/tree/host/topology.h"
#include "tests/cpu/shapes.h"
#include "tests/device/fixture.h"
#include "tools/hard/hard.h"

namespace ballot {
namespace {

/// A scene with its points, from either registry.
struct PointScene {
  Scene scene;
  std::vector<HardPoints> sets;
  BuildSettings build = {};
};

struct PointCase {
  std::string name;
  std::function<PointScene()> make;
};

std::ostream& operator<<(std::ostream& out, const PointCase& c) { return out << c.name; }

std::vector<PointCase> point_cases() {
  std::vector<PointCase> all;
  for (const HardPointCase& hard : hard_point_cases())
    all.push_back({std::string(hard.name), [&hard] {
                     HardPointScene made = hard.make(true);
                     return PointScene{std::move(made.scene), std::move(made.sets)};
                   }});
  for (const HardCase& hard : hard_cases())
    all.push_back({std::string(hard.name), [&hard] {
                     HardScene made = hard.make(true);
                     std::vector<HardPoints> sets = hard_points_of(made.scene.triangles, true);
                     return PointScene{std::move(made.scene), std::move(sets), made.build};
                   }});
  for (PointCase& c : all) std::ranges::replace(c.name, '-', '_');
  return all;
}

bool is_finite(const glm::vec3& p) { return glm::all(glm::lessThan(glm::abs(p), glm::vec3(INFINITY))); }

/// Returns a lower bound of the squared distance of a triangle, by its box.
double least_square(const glm::dvec3& p, const Triangle& t) {
  const glm::dvec3 lo = glm::min(t[0], glm::min(t[1], t[2])), hi = glm::max(t[0], glm::max(t[1], t[2]));
  const glm::dvec3 out = glm::max(glm::max(lo - p, p - hi), glm::dvec3(0));
  return glm::dot(out, out) * (1 - 1e-12);
}

/// Returns the nearest triangle by exact arithmetic over all of them, within the limit. `likely` is tried first.
std::uint32_t nearest_of_all(const ProbePoint& p, std::span<const Triangle> triangles, std::uint32_t likely) {
  if (!is_finite(p.at)) return NO_HIT;
  std::uint32_t best = NO_HIT;
  ExactDistance least;
  double square = INFINITY;
  const auto consider = [&](std::uint32_t i) {
    if (is_degenerate(triangles[i]) || least_square(p.at, triangles[i]) > square) return;
    ExactDistance d = exact_distance(p.at, triangles[i]);
    const auto order = best == NO_HIT ? std::strong_ordering::less : d <=> least;
    if (order > 0 || (order == 0 && i >= best)) return;
    best = i, least = std::move(d), square = least.distance() * least.distance() * (1 + 1e-12);
  };
  if (likely != NO_HIT) consider(likely);
  for (std::uint32_t i = 0; i < triangles.size(); ++i) consider(i);
  if (!(p.limit >= 0)) return NO_HIT;
  if (best == NO_HIT || p.limit == INFINITY) return best;
  const Dyadic limit(p.limit);
  return limit * limit * least.below < least.above ? NO_HIT : best;
}

class HardPointCases : public DeviceTest, public testing::WithParamInterface<PointCase> {
 protected:
  static void expect_within(const QueryErrors& errors, std::size_t count, bool exact, const std::string& what) {
    EXPECT_EQ(errors.checked, count) << what;
    EXPECT_EQ(errors.beyond, 0u) << what;
    EXPECT_TRUE(!exact || errors.wrong == 0) << what << ": " << errors.wrong << " wrong";
  }

  static bool same_but_for_side(const Nearest& a, const Nearest& b) {
    return std::memcmp(&a, &b, offsetof(Nearest, behind)) == 0;
  }

  /// Expects that the oracles find what exact arithmetic finds for every 40th point.
  static void expect_right_oracles(const Traced& t, const HardPoints& set) {
    const PairTree& tree = t.tracer->pair_tree(NodeLayout::Interleaved);
    const ExactClosestPoints closest(tree);
    const ExactCrossings crossings(tree);
    for (std::size_t i = 0; i < set.points.size(); i += 40) {
      const ProbePoint& p = set.points[i];
      const std::uint32_t found = closest.nearest(p.at, p.limit).prim;
      EXPECT_EQ(found, nearest_of_all(p, t.triangles, found)) << set.name << ", point " << i;
      if (!is_finite(p.at)) continue;
      EXPECT_EQ(crossings.inside(p.at), exact_inside(p.at, t.triangles)) << set.name << ", point " << i;
    }
  }
};

// Closest points, inside tests and sides: those of exact arithmetic in mode exact, else within their bounds.
TEST_P(HardPointCases, Hold) {
  const PointScene made = GetParam().make();
  const auto t = make(*gpu_, made.scene.triangles, made.build);
  PointQueries queries(*gpu_, t->tracer->tree());
  const QueryJudge judge(t->tracer->tree());
  const bool closed = topology_of(t->triangles).closed();
  for (const HardPoints& set : made.sets) {
    const std::size_t count = set.points.size();
    expect_right_oracles(*t, set);
    for (const bool exact : {false, true}) {
      const std::string what = fmt::format("{}, {}{}", GetParam().name, set.name, exact ? ", exact" : "");
      std::vector<Nearest> near(count, Nearest{{}, -1, 7, 0, 0, 7}), sides = near;
      std::vector<std::uint32_t> inside(count, 7);
      queries.nearest(set.points, near, {.exact = exact});
      queries.nearest(set.points, sides, {.exact = exact, .sides = true});
      queries.inside(set.points, inside, {.exact = exact});
      expect_within(judge.nearest(set.points, near), count, exact, what);
      if (!std::ranges::equal(near, sides, same_but_for_side))
        expect_within(judge.nearest(set.points, sides), count, exact, what + ", with sides");
      expect_within(judge.sides(set.points, sides), count, exact, what + ", sides");
      if (closed || exact) expect_within(judge.inside(set.points, inside), count, exact, what + ", inside");
      EXPECT_TRUE(std::ranges::all_of(sides, [](const Nearest& n) { return n.behind <= 1; })) << what;
      EXPECT_TRUE(std::ranges::all_of(inside, [](std::uint32_t i) { return i <= 1; })) << what;
    }
  }
}

/// Returns the triangles as two meshes, of those with an even number and of the others.
Forest in_two(const shapes::Triangles& triangles, const BuildSettings& settings) {
  std::vector<shapes::Triangles> meshes(2);
  for (std::size_t i = 0; i < triangles.size(); ++i) meshes[i % 2].push_back(triangles[i]);
  const Placement placements[] = {{0, {}}, {1, {}}};
  return Forest(std::move(meshes), placements,
                [&](std::span<const Triangle> mesh) { return build_bvh(mesh, settings); });
}

// The same with every other triangle in a second instance, so that the nearest ones are often of both.
TEST_P(HardPointCases, HoldInTwoInstances) {
  const PointScene made = GetParam().make();
  Forest forest = in_two(made.scene.triangles, made.build);
  DeviceTree tree(*gpu_, forest);
  PointQueries queries(*gpu_, tree);
  const QueryJudge judge(tree);
  for (const HardPoints& set : made.sets)
    for (const bool exact : {false, true}) {
      const std::size_t count = set.points.size();
      const std::string what = fmt::format("{}, {}{}", GetParam().name, set.name, exact ? ", exact" : "");
      std::vector<Nearest> sides(count, Nearest{{}, -1, 7, 0, 0, 7});
      std::vector<std::uint32_t> inside(count, 7);
      queries.nearest(set.points, sides, {.exact = exact, .sides = true});
      queries.inside(set.points, inside, {.exact = exact});
      expect_within(judge.nearest(set.points, sides), count, exact, what);
      expect_within(judge.sides(set.points, sides), count, exact, what + ", sides");
      if (exact) expect_within(judge.inside(set.points, inside), count, exact, what + ", inside");
    }
}

// A case has a description and is generated identically each time.
TEST_P(HardPointCases, AreAsTheySay) {
  const PointScene made = GetParam().make(), again = GetParam().make();
  ASSERT_EQ(again.sets.size(), made.sets.size());
  for (std::size_t s = 0; s < made.sets.size(); ++s) {
    const std::vector<ProbePoint>&a = made.sets[s].points, &b = again.sets[s].points;
    ASSERT_TRUE(!a.empty() && a.size() == b.size()) << made.sets[s].name;
    EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(ProbePoint)), 0) << made.sets[s].name;
  }
}

std::string point_case_name(const testing::TestParamInfo<PointCase>& info) { return info.param.name; }

INSTANTIATE_TEST_SUITE_P(Hard, HardPointCases, testing::ValuesIn(point_cases()), point_case_name);

TEST(HardPointRegistry, DescribesItsCases) {
  for (const HardPointCase& hard : hard_point_cases()) {
    EXPECT_FALSE(hard.from.empty() || hard.what.empty()) << hard.name;
    EXPECT_FALSE(hard.make(true).sets.empty()) << hard.name;
  }
}

}  // namespace
}  // namespace ballot
