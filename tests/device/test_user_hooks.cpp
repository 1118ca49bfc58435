// Kernels of users with accept(): what it sees, and what its answers do.
#include "engine/core/error.h"
#include "tests/device/forests.h"
#include "tests/device/user_kernels.h"

namespace ballot {
namespace {

constexpr const char* kOdd = "bool accept(Hit hit) { return hit.prim % 2u == 1u; }";
/// Adds up what accept() sees, and refuses it.
constexpr const char* kSum = R"(
uint seen = 0u;
bool accept(Hit hit) {
  seen += (hit.prim + 1u) * 2654435761u ^ floatBitsToUint(hit.t) ^ floatBitsToUint(hit.u) * 3u;
  return false;
}
)";

class UserHooks : public UserKernelTest {
 protected:
  static std::uint32_t bits(float x) { return std::bit_cast<std::uint32_t>(x); }
  /// What kSum adds up over all crossings.
  static std::vector<std::uint32_t> sums_of(const std::vector<std::vector<Hit>>& lists) {
    std::vector<std::uint32_t> sums;
    for (const auto& list : lists) {
      std::uint32_t sum = 0;
      for (const Hit& h : list) sum += (h.prim + 1) * 2654435761u ^ bits(h.t) ^ bits(h.u) * 3;
      sums.push_back(sum);
    }
    return sums;
  }
};

// The answers without the even triangles are those of a scene without them.
TEST_F(UserHooks, LeaveOutWhatTheyRefuse) {
  const shapes::Triangles all = shapes::soup(2000, 0.2f);
  shapes::Triangles odd;
  for (std::size_t i = 1; i < all.size(); i += 2) odd.push_back(all[i]);
  const auto t = make(*gpu_, all, {.split_budget = 1}), without = make(*gpu_, odd);
  ASSERT_GT(t->bvh.stats.references, all.size());
  std::vector<Ray> rays = shapes::random_rays(3000);
  Answers truth = built_in(*without->tracer, rays, {});
  for (Hit& hit : truth.hits)
    if (hit.prim != NO_HIT) hit.prim = 2 * hit.prim + 1;
  DeviceTree& tree = t->tracer->tree();
  EXPECT_EQ(different(answers<Hit>(tree, over_rays("Hit", "nearest(rays[index])", kOdd), rays), truth.hits), 0u);
  EXPECT_EQ(
      different(answers<std::uint32_t>(tree, over_rays("uint", "uint(any(rays[index]))", kOdd), rays), truth.occluded),
      0u);
  EXPECT_EQ(different(answers<std::uint32_t>(tree, over_rays("uint", "count(rays[index])", kOdd), rays), truth.counts),
            0u);
  std::vector<ProbePoint> points;
  for (const Ray& r : rays) points.push_back({r.origin, std::numeric_limits<float>::infinity()});
  truth = built_in(*without->tracer, rays, points);
  for (Nearest& near : truth.near) near.prim = 2 * near.prim + 1;
  EXPECT_EQ(
      different(answers<Nearest>(tree, over_rays("Nearest", "closest(rays[index].origin)", kOdd), rays), truth.near),
      0u);
  for (Hit& hit : truth.hits)
    if (hit.prim != NO_HIT) hit.prim = 2 * hit.prim + 1;
  const Answers whole = built_in(*t->tracer, rays, points);
  EXPECT_GT(different(whole.hits, truth.hits), 300u);
}

TEST_F(UserHooks, SeeEachCrossingOnce) {
  const auto t = make(*gpu_, shapes::soup(2000, 0.2f), {.split_budget = 1});
  Forest forest = forests::make_forest(forests::three_meshes(), forests::twelve_instances());
  Tracer among(*gpu_, forest);
  const std::vector<Ray> rays = shapes::random_rays(2000);
  for (Tracer* tracer : {t->tracer.get(), &among}) {
    RayQueries queries(*gpu_, tracer->tree());
    const std::vector<std::uint32_t> truth = sums_of(lists(queries, rays));
    for (const char* call : {"count", "any"}) {
      const std::string answer = fmt::format("uint({}(rays[index])) * 0u + seen", call);
      const auto sums = answers<std::uint32_t>(tracer->tree(), over_rays("uint", answer, kSum), rays);
      EXPECT_EQ(different(sums, truth), 0u) << call;
    }
  }
}

// A ray goes on from what it met, without an offset.
TEST_F(UserHooks, PassOverWhatARayCameFrom) {
  const auto t = make(*gpu_, shapes::soup(1000, 0.3f));
  RayQueries queries(*gpu_, t->tracer->tree());
  const std::vector<Ray> rays = shapes::random_rays(1000);
  const auto lists = this->lists(queries, rays);
  UserText text = over_rays("uint", "steps(rays[index])", R"(
uint from = NO_HIT;
bool accept(Hit hit) { return hit.prim != from; }
uint steps(Ray ray) {
  uint count = 0u;
  for (Hit hit = nearest(ray); hit.prim != NO_HIT; hit = nearest(ray)) {
    ++count;
    from = hit.prim;
    ray.t_min = hit.t;
  }
  return count;
})");
  const auto steps = answers<std::uint32_t>(t->tracer->tree(), text, rays);
  for (std::size_t i = 0; i < rays.size(); ++i) ASSERT_EQ(steps[i], lists[i].size()) << i;
}

/// Spheres of the user's own.
constexpr const char* kSphere = R"(
readonly buffer Spheres { vec4 spheres[]; };
bool intersect(uint prim, Ray ray, inout Hit hit) {
  vec4 sphere = spheres[prim % spheres.length()];
  vec3 to = sphere.xyz - ray.origin;
  float a = dot(ray.dir, ray.dir), along = dot(to, ray.dir) / a;
  vec3 beside = to - along * ray.dir;
  float rest = sphere.w * sphere.w - dot(beside, beside);
  if (rest < 0.0) return false;
  float half_way = sqrt(rest / a);
  hit.t = along - half_way >= ray.t_min ? along - half_way : along + half_way;
  hit.u = half_way;
  return true;
}
)";

class UserShapes : public UserHooks {
 protected:
  static std::vector<glm::vec4> spheres(std::size_t count) {
    shapes::Random random(5);
    std::vector<glm::vec4> all;
    for (std::size_t i = 0; i < count; ++i) all.emplace_back(random.point(1), random.in(0.01f, 0.2f));
    return all;
  }
  static UnsetVector<Triangle> stand_ins_of(const std::vector<glm::vec4>& spheres) {
    std::vector<Bounds> boxes;
    for (const glm::vec4& s : spheres) boxes.push_back({glm::vec3(s) - s.w * 1.001f, glm::vec3(s) + s.w * 1.001f});
    return stand_ins(boxes);
  }
  static std::vector<Hit> hits_of(DeviceTree& tree, const std::vector<glm::vec4>& spheres, std::span<const Ray> rays,
                                  const std::string& call, const std::string& before = "") {
    UserKernel kernel(*gpu_, tree, over_rays("Hit", call, kSphere + before));
    const Buffer<Ray> asked = on_device(rays, "rays");
    const Buffer<glm::vec4> shapes = on_device(std::span<const glm::vec4>(spheres), "spheres");
    Buffer<Hit> found(*gpu_, rays.size(), Access::Storage, "answers");
    kernel.bind("rays", asked);
    kernel.bind("answers", found);
    kernel.bind("spheres", shapes);
    kernel.run(std::uint32_t(rays.size()));
    return read(found);
  }
  /// The nearest sphere in double precision, or NO_HIT; `sure` is false where another may be as near.
  struct Seen {
    std::uint32_t prim = NO_HIT;
    double t = 1e300;
    bool sure = true;
  };
  static Seen seen_by(const Ray& ray, const std::vector<glm::vec4>& spheres) {
    Seen seen;
    double second = 1e300;
    for (std::uint32_t i = 0; i < spheres.size(); ++i) {
      const glm::dvec3 to = glm::dvec3(spheres[i]) - glm::dvec3(ray.origin), d = ray.dir;
      const double a = glm::dot(d, d), along = glm::dot(to, d) / a, r = double(spheres[i].w);
      const glm::dvec3 beside = to - along * d;
      const double rest = r * r - glm::dot(beside, beside);
      if (std::abs(rest) < 1e-5) seen.sure = false;
      if (rest < 0) continue;
      const double half = std::sqrt(rest / a), t = along - half >= double(ray.t_min) ? along - half : along + half;
      if (std::abs(along - half - double(ray.t_min)) < 1e-5) seen.sure = false;
      if (t < double(ray.t_min) || t > double(ray.t_max)) continue;
      second = std::min(second, std::max(t, seen.t));
      if (t < seen.t) seen.t = t, seen.prim = i;
    }
    seen.sure = seen.sure && second > seen.t + 1e-5;
    return seen;
  }
};

/// How many spheres a ray meets in its range; nothing where rounding may decide.
std::optional<std::uint32_t> count_of(const Ray& ray, const std::vector<glm::vec4>& spheres) {
  std::uint32_t count = 0;
  for (const glm::vec4& s : spheres) {
    const glm::dvec3 to = glm::dvec3(s) - glm::dvec3(ray.origin), d = ray.dir;
    const double a = glm::dot(d, d), along = glm::dot(to, d) / a, r = double(s.w);
    const double rest = r * r - glm::dot(to - along * d, to - along * d), half = std::sqrt(std::max(rest, 0.0) / a);
    const double t = along - half >= double(ray.t_min) ? along - half : along + half;
    const double edges[] = {rest, along - half - double(ray.t_min), t - double(ray.t_min), t - double(ray.t_max)};
    if (std::ranges::any_of(edges, [](double e) { return std::abs(e) < 1e-5; })) return {};
    count += rest > 0 && t >= double(ray.t_min) && t <= double(ray.t_max);
  }
  return count;
}

TEST_F(UserShapes, AreMetByRays) {
  const std::vector<glm::vec4> all = spheres(700);
  const auto t = make(*gpu_, stand_ins_of(all), {.split_budget = 1});
  const std::vector<Ray> rays = shapes::random_rays(3000);
  const auto hits = hits_of(t->tracer->tree(), all, rays, "nearest(rays[index])");
  const auto any = hits_of(t->tracer->tree(), all, rays, "any(rays[index]) ? Hit(1, 1, 1, 1) : Hit(0, 0, 0, 0)");
  const auto counts = hits_of(t->tracer->tree(), all, rays, "Hit(0, count(rays[index]), 0, 0)");
  std::size_t sure = 0, met = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    EXPECT_EQ(any[i].prim == 1, hits[i].prim != NO_HIT) << i;
    EXPECT_EQ(counts[i].prim > 0, hits[i].prim != NO_HIT) << i;
    EXPECT_EQ(counts[i].prim, count_of(rays[i], all).value_or(counts[i].prim)) << i;
    const Seen truth = seen_by(rays[i], all);
    if (!truth.sure) continue;
    ++sure;
    ASSERT_EQ(hits[i].prim, truth.prim) << i;
    if (truth.prim == NO_HIT) continue;
    ++met;
    ASSERT_NEAR(hits[i].t, truth.t, 1e-4) << i;
  }
  EXPECT_GT(sure, 2000u);
  EXPECT_GT(met, 1000u);
}

TEST_F(UserShapes, StandAmongTrianglesAndInInstances) {
  const std::vector<glm::vec4> all = spheres(100);
  const shapes::Triangles round = stand_ins_of(all), flat = shapes::soup(300, 0.2f);
  const std::vector<Ray> rays = shapes::random_rays(2000);
  const auto mixed = make(*gpu_, shapes::joined(round, flat)), rest = make(*gpu_, flat), own = make(*gpu_, round);
  const auto hits = hits_of(mixed->tracer->tree(), all, rays, "nearest(rays[index])",
                            "bool is_shape(uint prim) { return prim < 100u; }");
  const auto round_hits = hits_of(own->tracer->tree(), all, rays, "nearest(rays[index])");
  const Answers flat_hits = built_in(*rest->tracer, rays, {});
  std::vector<Hit> truth = round_hits;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const Hit& other = flat_hits.hits[i];
    if (other.t < truth[i].t) truth[i] = {other.t, other.prim + 100, other.u, other.v};
  }
  EXPECT_EQ(different(hits, truth), 0u);
  const Placement placements[] = {{0, forests::moved({0, 0, 0})}, {0, forests::moved({50, 0, 0})}};
  Forest forest = forests::make_forest({round}, placements);
  Tracer tracer(*gpu_, forest);
  EXPECT_EQ(different(hits_of(tracer.tree(), all, rays, "nearest(rays[index])"), round_hits), 0u);
  std::vector<Ray> beside = rays;
  for (Ray& ray : beside) ray.origin.x += 50;
  const auto second = hits_of(tracer.tree(), all, beside, "nearest(rays[index])");
  std::size_t same = 0;
  for (std::size_t i = 0; i < rays.size(); ++i)
    same += second[i].prim == (round_hits[i].prim == NO_HIT ? NO_HIT : round_hits[i].prim + 100);
  EXPECT_GT(same, 1980u);  // origins are rounded at 50
}

TEST_F(UserShapes, WrongOnesAreRefused) {
  const auto t = make(*gpu_, stand_ins(std::vector<Bounds>{{{0, 0, 0}, {0, 0, 0}}, {{1, 2, 3}, {1, 2, 4}}}));
  EXPECT_EQ(t->bvh.stats.degenerate, 0u);
  EXPECT_THROW(stand_ins(std::vector<Bounds>{{{0, 0, 0}, {1, -1, 1}}}), Error);
  EXPECT_THROW(stand_ins(std::vector<Bounds>{{{0, NAN, 0}, {1, 1, 1}}}), Error);
  EXPECT_THROW(UserKernel(*gpu_, t->tracer->tree(), over_rays("uint", "closest(rays[index].origin).prim", kSphere)),
               Error);
}

}  // namespace
}  // namespace ballot
