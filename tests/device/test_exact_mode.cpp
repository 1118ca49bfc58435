// Tests of numeric mode exact on a device. Every answer must be the exact oracle's; ties are not allowed.
#include <cmath>

#include "engine/oracle/exact.h"
#include "tests/cpu/exact_cases.h"
#include "tests/device/fixture.h"
#include "tests/device/ray_sets.h"

namespace ballot {
namespace {

using exact_cases::transformed;
using shapes::Triangles;

void append(Triangles& all, const Triangles& more) { all.insert(all.end(), more.begin(), more.end()); }
void append(std::vector<Ray>& all, const std::vector<Ray>& more) { all.insert(all.end(), more.begin(), more.end()); }

/// Returns a height field over the integers from -4 to 4, with random integer heights from 0 to 2.
Triangles integer_grid() {
  shapes::Random random(31);
  float height[9][9];
  for (auto& row : height)
    for (float& h : row) h = static_cast<float>(random.below(3));
  const auto at = [&](int i, int j) { return glm::vec3(float(i - 4), height[i][j], float(j - 4)); };
  Triangles out;
  for (int i = 0; i < 8; ++i)
    for (int j = 0; j < 8; ++j) {
      out.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      out.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  return out;
}

/// Returns overlapping triangles of different shapes that all lie exactly in the plane x + 2 y - z = 1.
Triangles tilted_coplanar(std::size_t count) {
  shapes::Random random(32);
  const auto point = [&] {
    const float x = float(random.below(33)) / 8 - 2, y = float(random.below(33)) / 8 - 2;
    return glm::vec3(x, y, x + 2 * y - 1);
  };
  Triangles out;
  while (out.size() < count) out.push_back({point(), point(), point()});
  return out;
}

/// Returns rays along axes and diagonals through points whose coordinates are integers and halves.
std::vector<Ray> grid_rays() {
  std::vector<Ray> out;
  for (int i = -9; i <= 9; ++i)
    for (int j = -9; j <= 9; ++j) {
      const float x = float(i) / 2, y = float(j) / 2;
      out.push_back({{x, 5, y}, 0, {0, -1, 0}, 1e30f});
      out.push_back({{x, 1, y}, -1e30f, {-0.f, 3, 0}, 2});
      out.push_back({{-6, x, y}, 0, {1, 0, -0.f}, 1e30f});
      out.push_back({{x, y, 5}, 0, {1, -1, -2}, 7});
      out.push_back({{x, 4, y}, 0, {1, -2, 1}, 1e30f});
    }
  return out;
}

/// Returns rays at vertices, from origins whose difference to the vertex is exact, and rays at points of edges.
std::vector<Ray> vertex_rays(const Triangles& triangles, std::size_t count) {
  shapes::Random random(33);
  std::vector<Ray> out;
  while (out.size() < count) {
    const Triangle& t = triangles[random.below(triangles.size())];
    const glm::vec3 v = t[random.below(3)];
    out.push_back({{0, 0, 0}, 0, v, random.below(2) == 0 ? 1.f : 1e30f});
    out.push_back({v, 0, random.point(1), 1e30f});
    out.push_back({v + v, 0, -v, 1e30f});
    out.push_back(exact_cases::ray_at(t, random));
  }
  return out;
}

/// Returns every `every`-th ray that hits, with t_min or t_max at the t of its hit and one ulp below and above.
std::vector<Ray> ending_at_hits(const ExactOracle& oracle, std::span<const Ray> rays, std::size_t every) {
  constexpr float kFar = 3e38f;
  std::vector<Ray> out;
  for (std::size_t i = 0; i < rays.size(); i += every) {
    const ExactHit hit = oracle.nearest(rays[i]);
    if (hit.prim == NO_HIT || std::abs(hit.t) > 1e38) continue;
    const float t = float(hit.t);
    for (const float end : {std::nextafter(t, -kFar), t, std::nextafter(t, kFar)}) {
      Ray ray = rays[i];
      ray.t_max = end;
      out.push_back(ray);
      ray = rays[i];
      ray.t_min = end;
      out.push_back(ray);
    }
  }
  return out;
}

/// Returns the distance of two numbers in units in the last place of b.
double ulps_apart(float a, double b) {
  return std::abs(a - b) / std::ldexp(1, std::ilogb(std::max(std::abs(b), 0x1p-126)) - 23);
}

class ExactMode : public DeviceTest {
 protected:
  /// Returns what is wrong with a hit, or an empty text. `truth` is the exact nearest hit. t may be off by one ulp, u
  /// and v by 2^-22.
  static std::string wrong(const ExactOracle& oracle, const Ray& ray, const Hit& hit, const ExactHit& truth,
                           Want want) {
    if ((hit.prim == NO_HIT) != (truth.prim == NO_HIT)) return truth.prim == NO_HIT ? "false hit" : "false miss";
    if (hit.prim == NO_HIT) return "";
    if (want == Want::Nearest && hit.prim != truth.prim) return "wrong prim";
    const ExactHit own = want == Want::Nearest ? truth : oracle.hit(ray, hit.prim);
    if (own.prim == NO_HIT) return "a prim that the ray does not hit";
    if (!(ulps_apart(hit.t, own.t) <= 1)) return "wrong t";
    if (!(std::abs(hit.u - own.u) <= 0x1p-22 && std::abs(hit.v - own.v) <= 0x1p-22)) return "wrong weights";
    return hit.t >= ray.t_min && hit.t <= ray.t_max ? "" : "t out of range";
  }

  /// Returns methods that traverse in different ways, with their knobs.
  static std::vector<std::pair<const char*, Knobs>> held(Want want) {
    std::vector<std::pair<const char*, Knobs>> out;
    for (const char* method : {"while-while", "packet", "cut", "dynamic-fetch"}) out.push_back({method, {}});
    for (const char* doubtful : {"decided", "limited", "listed"})
      out.push_back({"while-while", {{"doubtful", doubtful}}});
    out.push_back({"packet-wide", harness::kNoFallback});
    if (want == Want::Nearest) out.push_back({"packet-wide", {{"rays", "2"}, {"fallback", "0"}}});
    return out;
  }

  /// Traces the rays with methods that traverse in different ways, for the closest hit and any hit, and holds every hit
  /// to the exact oracle. Adds rays that end at hits. Checks the oracle itself by brute force on some rays.
  static void hold(Bvh bvh, const Triangles& triangles, std::vector<Ray> rays) {
    Tracer tracer(*gpu_, bvh, triangles, facts_for(bvh, Facts::OfMostTrees));
    tracer.prefill = harness::kPattern;
    const ExactOracle oracle(tracer.pair_tree(NodeLayout::Interleaved));
    append(rays, ending_at_hits(oracle, rays, 7));
    const auto truth = oracle.nearest(rays);
    for (std::size_t i = 0; i < rays.size(); i += rays.size() / 25 + 1)
      ASSERT_EQ(truth[i].prim, oracle.brute_force(rays[i]).prim);
    std::vector<Hit> first;
    for (const Want want : {Want::Nearest, Want::Any})
      for (const auto& [method, knobs] : held(want)) {
        const Query query{want, method, "exact", knobs};
        std::vector<Hit> hits(rays.size());
        tracer.trace(rays, hits, query);
        std::size_t errors = 0;
        for (std::size_t i = 0; i < rays.size(); ++i) {
          const std::string what = wrong(oracle, rays[i], hits[i], truth[i], want);
          if (what.empty() || ++errors > 3) continue;
          const Ray& r = rays[i];
          ADD_FAILURE() << fmt::format(
              "{}, ray {} ({} {} {} from {}, along {} {} {} to {}): {}: found prim {} at t {}; the nearest is prim {} "
              "at t {}",
              tracer.variant(query).name(), i, r.origin.x, r.origin.y, r.origin.z, r.t_min, r.dir.x, r.dir.y, r.dir.z,
              r.t_max, what, int(hits[i].prim), hits[i].t, int(truth[i].prim), truth[i].t);
        }
        EXPECT_EQ(errors, 0u) << "wrong answers of " << rays.size() << " rays, " << tracer.variant(query).name();
        if (want == Want::Any) continue;
        if (first.empty()) first = hits;
        EXPECT_EQ(harness::count_different(first, hits), 0u) << tracer.variant(query).name();
      }
  }
};

// Rays that meet shared edges and vertices, integer coordinates, equal t, slivers, and planes seen edge-on.
TEST_F(ExactMode, WhereRaysMeetEdgesVerticesAndEachOther) {
  Triangles triangles = integer_grid();
  append(triangles, tilted_coplanar(40));
  append(triangles, shapes::identical(12));
  append(triangles, shapes::coplanar(40));
  append(triangles, shapes::slivers(60));
  append(triangles, transformed(shapes::sphere(2), 3));
  append(triangles, shapes::soup(200, 0.3f));
  std::vector<Ray> rays = grid_rays();
  append(rays, vertex_rays(triangles, 1200));
  append(rays, shapes::axis_rays(triangles, 300));
  append(rays, shapes::grazing(triangles, 300));
  append(rays, shapes::on_triangles(triangles, 300));
  append(rays, shapes::edge_rays(triangles, 400, {0.125f, 0.25f, -0.5f}));
  append(rays, shapes::random_rays(501));
  append(rays, shapes::odd_scales(101));
  append(rays, shapes::dead_rays());
  hold(build_bvh(triangles), triangles, rays);
}

// Rays that hit many triangles at one t, which is not that of the lane's other rays.
TEST_F(ExactMode, ManyTrianglesAtOneT) {
  const Triangles triangles = shapes::same_centroid(24);
  shapes::Random random(36);
  std::vector<Ray> rays;
  for (int i = 0; i < 501; ++i) {
    const glm::vec3 from = random.point(2);
    rays.push_back({from, 0, -from * std::ldexp(1.f, -(i % 5)), 1e30f});
  }
  hold(build_bvh(triangles), triangles, rays);
}

TEST_F(ExactMode, FarFromTheOrigin) {
  const glm::vec3 centre(448376, 5411934, 223423);  // as large as UTM coordinates in metres
  Triangles triangles = transformed(shapes::sphere(3), 10, centre);
  append(triangles, transformed(shapes::soup(200, 0.3f), 10, centre));
  std::vector<Ray> rays;
  for (const Ray& r : shapes::random_rays(700)) append(rays, transformed({r}, 10, centre));
  shapes::Random random(34);
  for (int i = 0; i < 700; ++i) {
    const Triangle& t = triangles[random.below(triangles.size())];
    rays.push_back(shapes::towards(centre, t[random.below(3)]));
    rays.push_back(shapes::towards({0, 0, 0}, t[0] + (t[1] - t[0]) * random.in(0, 1)));
  }
  hold(build_bvh(triangles), triangles, rays);
}

/// Returns rays from 2^4 to 2^50 radii away, at vertices and beside them.
std::vector<Ray> from_afar(const Triangles& triangles, std::size_t count) {
  shapes::Random random(37);
  const glm::vec3 slanted(4091, 242, 3);  // float32 finds its products a little too large
  std::vector<Ray> out{{-65536.f * 2540.f * slanted, 0, slanted, 1e30f}};
  while (out.size() < count) {
    const glm::vec3 v = triangles[random.below(triangles.size())][random.below(3)];
    const float distance = std::ldexp(1.f, 4 + int(random.below(47)));
    out.push_back({distance * v, 0, -v, 1e30f});  // through the vertex, exactly
    out.push_back({distance * v, distance - 1, -v, distance});
    out.push_back({distance * random.point(1), 0, v, 1e30f});
    const glm::vec3 from = distance * random.point(1);
    out.push_back(shapes::towards(from, v));
    out.push_back({from, -1e30f, std::ldexp(1.f, -int(random.below(60))) * from, 1e30f});
    // Through zero, exactly: a product of integers of 12 bits each.
    const glm::vec3 d(float(random.below(8191)) - 4095, float(random.below(8191)) - 4095,
                      float(random.below(4095)) + 1);
    out.push_back({std::ldexp(float(2 * random.below(2047) + 1), int(random.below(40))) * -d, 0, d, 1e30f});
  }
  return out;
}

// Rays from far away are walked from another origin.
TEST_F(ExactMode, FromFarAway) {
  Triangles triangles = shapes::sphere(2);
  append(triangles, shapes::soup(150, 0.3f));
  hold(build_bvh(triangles), triangles, from_afar(triangles, 1500));
  triangles = transformed(triangles, 1, {20, -30, 10});
  std::vector<Ray> rays;
  for (const Ray& r : from_afar(triangles, 500)) append(rays, transformed({r}, 1, {20, -30, 10}));
  hold(build_bvh(triangles), triangles, rays);
}

/// Returns how many triangles `while-while` tests for these rays.
double triangles_tested(Context& gpu, const Triangles& triangles, const std::vector<Ray>& rays) {
  const Bvh bvh = build_bvh(triangles);
  Tracer tracer(gpu, bvh, triangles, facts_of(bvh));
  Buffer<Ray> there(gpu, rays.size(), Access::Storage, "rays");
  Buffer<Hit> hits(gpu, rays.size(), Access::Storage, "hits");
  Buffer<RayStats> stats(gpu, rays.size(), Access::Storage, "stats");
  there.upload(rays);
  tracer.trace_counted(there, hits, std::uint32_t(rays.size()), {.method = "while-while", .numeric = "exact"}, stats);
  std::vector<RayStats> all(rays.size());
  stats.download(all);
  double tested = 0;
  for (const RayStats& s : all) tested += s.triangles_tested;
  return tested;
}

TEST_F(ExactMode, DistanceCostsNoWork) {
  const Triangles triangles = shapes::sphere(4);
  const auto work = [&](float distance) {
    shapes::Random random(38);
    std::vector<Ray> rays;
    for (int i = 0; i < 256; ++i)
      rays.push_back(shapes::towards(distance * glm::vec3(0.6f, 0, 0.8f), random.point(0.5f)));
    return triangles_tested(*gpu_, triangles, rays);
  };
  const double near = work(4);
  EXPECT_GT(near, 0);
  for (const float distance : {100.f, 1e4f, 1e6f}) EXPECT_LT(work(distance), 2 * near) << distance;
}

// A ray in a small part of a scene does not test all triangles of parts that are smaller still.
TEST_F(ExactMode, SmallPartsCostNoWork) {
  const auto sphere = [](int e) {
    return transformed(shapes::sphere(4), std::ldexp(1.f, e), {std::ldexp(64.f, e), 0, 0});
  };
  Triangles all = sphere(-10);
  for (const int e : {-40, -50, -60, -70, -80}) append(all, sphere(e));
  shapes::Random random(39);
  std::vector<Ray> rays;
  for (int i = 0; i < 256; ++i)
    append(rays, transformed({shapes::towards(random.point(4), random.point(0.5f))}, 0x1p-40f, {0x1p-34f, 0, 0}));
  const double alone = triangles_tested(*gpu_, sphere(-40), rays);
  EXPECT_GT(alone, 0);
  EXPECT_LT(triangles_tested(*gpu_, all, rays), 2 * alone);
}

TEST_F(ExactMode, TinyScenes) {
  const Triangles triangles = transformed(shapes::soup(150, 0.5f), 1e-30f);
  std::vector<Ray> rays = transformed(shapes::random_rays(500), 1e-30f);
  append(rays, vertex_rays(triangles, 300));
  hold(exact_cases::PlainTree(triangles).bvh(), triangles, rays);
}

// Vertices and rays over the whole range of float32, denormal numbers included.
TEST_F(ExactMode, AllSizesAtOnce) {
  shapes::Random random(35);
  Triangles triangles = transformed(shapes::soup(40, 0.5f), 1e30f);
  append(triangles, transformed(shapes::soup(40, 0.5f), 1e-30f));
  append(triangles, transformed(shapes::soup(20, 0.5f), 1e-40f));
  append(triangles, shapes::huge_and_tiny(40));
  while (triangles.size() < 200)
    triangles.push_back(
        {exact_cases::awkward_point(random), exact_cases::awkward_point(random), exact_cases::awkward_point(random)});
  std::vector<Ray> rays = vertex_rays(triangles, 240);
  append(rays, shapes::random_rays(60));
  append(rays, transformed(shapes::random_rays(60), 1e30f));
  for (int i = 0; i < 240; ++i) {
    const float t_min = random.below(2) == 0 ? 0 : exact_cases::awkward(random);
    rays.push_back({exact_cases::awkward_point(random), t_min, exact_cases::awkward_point(random), 3e38f});
  }
  hold(exact_cases::PlainTree(triangles).bvh(), triangles, rays);
}

// Mesa 22.3's lavapipe cuts long loops short. Such rays are then traced against pieces of the tree, and the hits of the
// pieces are merged exactly.
TEST_F(ExactMode, WalksThatADriverCutsShortAreExactToo) {
  Triangles triangles = tilted_coplanar(3000);
  const std::vector<Ray> rays(33, Ray{{0.1f, 0.2f, 5}, 0, {0.03f, -0.02f, -1}, 1e30f});
  const Bvh bvh = build_bvh(triangles);
  Tracer tracer(*gpu_, bvh, triangles, facts_for(bvh, Facts::OfMostTrees));
  std::vector<Hit> hits(rays.size());
  tracer.trace(rays, hits, {.numeric = "exact"});
  const ExactHit truth = ExactOracle(tracer.pair_tree(NodeLayout::Interleaved)).nearest(rays[0]);
  for (const Hit& hit : hits) EXPECT_EQ(hit.prim, truth.prim);
}

}  // namespace
}  // namespace ballot
