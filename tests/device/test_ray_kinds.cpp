// Tests of the ray kinds: their rays follow the laws of each kind, recomputed in double precision, and every method
// finds the oracle's hits for each kind.
#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <map>

#include "tests/device/fixture.h"

namespace ballot {
namespace {

using namespace harness;

/// A primary hit in double precision, from which rays start.
struct Ground {
  glm::dvec3 position, normal, dir;  // dir is the primary ray's, normal is opposed to it; both are unit vectors
  std::uint32_t prim;
};

/// The rays of a ray kind and the primary hits from which they start.
struct MadeRays {
  std::unique_ptr<RayBatch> batch;
  std::vector<Ray> rays;
  std::vector<Ground> grounds;  // one per primary hit, in the order of pixels
};

class RayKinds : public testing::Test {
 protected:
  static std::unique_ptr<DeviceScene> open(Scene scene) {
    return std::make_unique<DeviceScene>(std::move(scene),
                                         DeviceSceneOptions{.device = "", .validate = true, .build = {}});
  }
  static void SetUpTestSuite() { world_ = open(load_scene(BALLOT_SOURCE_DIR "/scenes/cornell.gltf")); }
  static void TearDownTestSuite() { world_.reset(); }
  void TearDown() override { EXPECT_EQ(world_->messages(), std::vector<std::string>{}); }
  static inline std::unique_ptr<DeviceScene> world_;

  /// Traces the primary rays of the first view and returns their hits.
  static std::vector<Ground> grounds_of(DeviceScene& world, std::uint32_t width, std::uint32_t height) {
    const auto primary = world.make_batch(world.scene().views[0], find_ray_kind("primary"), width, height);
    world.trace(*primary, {});
    const std::vector<Ray> rays = primary->rays();
    const std::vector<Hit> hits = primary->hits();
    std::vector<Ground> all;
    for (std::size_t i = 0; i < hits.size(); ++i) {
      if (hits[i].prim == NO_HIT) continue;
      const Triangle& t = world.scene().triangles[hits[i].prim];
      const glm::dvec3 v0(t[0]), v1(t[1]), v2(t[2]);
      const double u = hits[i].u, v = hits[i].v;
      Ground g{v0 * (1 - u - v) + v1 * u + v2 * v, glm::normalize(glm::cross(v1 - v0, v2 - v0)),
               glm::normalize(glm::dvec3(rays[i].dir)), hits[i].prim};
      if (glm::dot(g.normal, g.dir) > 0) g.normal = -g.normal;
      all.push_back(g);
    }
    return all;
  }

  static MadeRays make(DeviceScene& world, const char* kind, std::uint32_t width = 96, std::uint32_t height = 64,
                       const RayKindOptions& options = {}) {
    MadeRays m{world.make_batch(world.scene().views[0], find_ray_kind(kind), width, height, options), {}, {}};
    m.rays = m.batch->rays();
    m.grounds = grounds_of(world, width, height);
    return m;
  }

  /// Returns the length of the diagonal of the scene's box.
  static double diagonal(const DeviceScene& world) {
    const Bounds& b = world.scene().bounds;
    return glm::length(glm::dvec3(b.hi) - glm::dvec3(b.lo));
  }

  /// Expects unit directions, t_min 0, and origins a little off the surface, on the side to which `side` times the
  /// normal points.
  static void expect_starts(const DeviceScene& world, std::span<const Ray> rays, std::span<const Ground> grounds,
                            std::size_t rays_per_hit, double side) {
    ASSERT_EQ(rays.size(), grounds.size() * rays_per_hit);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const Ground& g = grounds[i / rays_per_hit];
      ASSERT_NEAR(glm::length(glm::dvec3(rays[i].dir)), 1, 4e-7);
      ASSERT_EQ(rays[i].t_min, 0);
      const glm::dvec3 off = glm::dvec3(rays[i].origin) - g.position;
      ASSERT_GT(side * glm::dot(off, g.normal), 0) << i;
      ASSERT_LT(glm::length(off), 1e-5 * diagonal(world)) << i;
    }
  }
};

TEST_F(RayKinds, ReflectionsMirror) {
  const MadeRays m = make(*world_, "reflect");
  expect_starts(*world_, m.rays, m.grounds, 1, 1);
  for (std::size_t i = 0; i < m.rays.size(); ++i) {
    const Ground& g = m.grounds[i];
    const glm::dvec3 want = g.dir - 2 * glm::dot(g.dir, g.normal) * g.normal;
    ASSERT_LT(glm::length(glm::dvec3(m.rays[i].dir) - want), 2e-6);
    ASSERT_EQ(m.rays[i].t_max, 1e30f);
  }
}

TEST_F(RayKinds, RefractionsFollowSnell) {
  const MadeRays m = make(*world_, "refract");
  expect_starts(*world_, m.rays, m.grounds, 1, -1);
  for (std::size_t i = 0; i < m.rays.size(); ++i) {
    const Ground& g = m.grounds[i];
    const glm::dvec3 dir(m.rays[i].dir);
    // Snell's law: the index times the sine of the angle inside is the sine outside, and both rays lie in one plane.
    ASSERT_LT(glm::length(1.5 * glm::cross(dir, g.normal) - glm::cross(g.dir, g.normal)), 3e-6);
    ASSERT_LT(glm::dot(dir, g.normal), -0.7);
    ASSERT_EQ(m.rays[i].t_max, 1e30f);
  }
}

TEST_F(RayKinds, SecondaryIsReflectionsThenRefractions) {
  std::vector<Ray> want = make(*world_, "reflect").rays;
  for (const Ray& r : make(*world_, "refract").rays) want.push_back(r);
  const std::vector<Ray> rays = make(*world_, "secondary").rays;
  ASSERT_EQ(rays.size(), want.size());
  EXPECT_EQ(std::memcmp(rays.data(), want.data(), rays.size() * sizeof(Ray)), 0);
}

TEST_F(RayKinds, ShadowRaysEndAtTheLight) {
  const MadeRays m = make(*world_, "shadow");
  EXPECT_TRUE(m.batch->any());
  expect_starts(*world_, m.rays, m.grounds, 1, 1);
  // The position of the light by its definition.
  const glm::dmat4& camera = world_->scene().views[0].world_from_camera;
  const glm::dvec3 eye(camera[3]), dir = glm::normalize(glm::dvec3(camera[1]) + 0.5 * glm::dvec3(camera[0]));
  const Ray up{glm::vec3(eye), 0, glm::vec3(dir), 1e30f};
  std::vector<Hit> hit(1);
  world_->trace(std::span(&up, 1), hit);
  const glm::dvec3 light = eye + dir * std::min(0.15 * diagonal(*world_), 0.7 * double(hit[0].t));
  for (const Ray& r : m.rays) {
    const glm::dvec3 end = glm::dvec3(r.origin) + glm::dvec3(r.dir) * (double(r.t_max) / 0.999);
    ASSERT_LT(glm::length(end - light), 1e-5 * diagonal(*world_));
  }
}

// In a cosine distribution the cosine has mean 2/3 and variance 1/18, and the azimuth is uniform.
TEST_F(RayKinds, AmbientAndDiffuseRaysAreCosineDistributed) {
  for (const char* kind : {"ao", "diffuse"}) {
    const std::size_t n = kind == std::string("ao") ? 8 : 1;
    const MadeRays m = make(*world_, kind);
    EXPECT_EQ(m.batch->any(), n == 8);
    expect_starts(*world_, m.rays, m.grounds, n, 1);
    double cosines = 0, squares = 0;
    glm::dvec3 sideways(0);
    for (std::size_t i = 0; i < m.rays.size(); ++i) {
      const glm::dvec3 normal = m.grounds[i / n].normal, dir(m.rays[i].dir);
      const double cosine = glm::dot(dir, normal);
      ASSERT_GT(cosine, 0);
      cosines += cosine;
      squares += cosine * cosine;
      sideways += dir - cosine * normal;
      ASSERT_EQ(m.rays[i].t_max, n == 8 ? float(0.05f * diagonal(*world_)) : 1e30f);
    }
    const double count = double(m.rays.size()), sigma = 1 / std::sqrt(count);
    EXPECT_NEAR(cosines / count, 2. / 3, 4 * std::sqrt(1. / 18) * sigma) << kind;
    EXPECT_NEAR(squares / count, 0.5, 4 * std::sqrt(1. / 12) * sigma) << kind;
    EXPECT_LT(glm::length(sideways) / count, 5 * sigma) << kind;
  }
}

TEST_F(RayKinds, OptionsAreFollowedAndChecked) {
  const MadeRays m = make(*world_, "ao", 32, 32, {.ao_rays = 3, .ao_radius = 0.5f});
  EXPECT_EQ(m.rays.size(), 3 * m.grounds.size());
  for (const Ray& r : m.rays) ASSERT_NEAR(r.t_max, 0.5 * diagonal(*world_), 1e-4);
  const View& view = world_->scene().views[0];
  const RayKind& ao = find_ray_kind("ao");
  EXPECT_THROW(world_->make_batch(view, ao, 32, 32, {.ao_rays = 0}), Error);
  EXPECT_THROW(world_->make_batch(view, ao, 32, 32, {.ao_rays = 8, .ao_radius = -1}), Error);
  EXPECT_THROW(world_->make_batch(view, ao, 0, 32), Error);
  try {
    find_ray_kind("glossy");
    ADD_FAILURE() << "ray kind 'glossy' was accepted, expected an error";
  } catch (const Error& e) {
    EXPECT_EQ(e.what(), "no ray kind is called 'glossy'; there are: " + names_of(kRayKinds));
  }
}

TEST_F(RayKinds, EqualCallsGiveEqualRays) {
  const View& view = world_->scene().views[0];
  for (const RayKind& kind : kRayKinds) {
    const auto batch = world_->make_batch(view, kind, 75, 50), again = world_->make_batch(view, kind, 75, 50);
    const std::vector<Ray> rays = batch->rays();
    ASSERT_EQ(rays.size(), again->count()) << kind.name;
    EXPECT_EQ(std::memcmp(rays.data(), again->rays().data(), rays.size() * sizeof(Ray)), 0) << kind.name;
    const FrameTimes times = world_->frame(*batch, {.method = "packet", .numeric = "plain"});
    EXPECT_GT(times.generate_ms, 0);
    EXPECT_GT(times.trace_ms, 0);
    EXPECT_GT(times.shade_ms, 0);
    EXPECT_EQ(std::memcmp(rays.data(), batch->rays().data(), rays.size() * sizeof(Ray)), 0) << kind.name;
  }
}

// A picture whose size is not a multiple of a tile's has its rays in the order of tiles, without rays for pixels
// outside the picture.
TEST_F(RayKinds, NoRayOfTilePaddingIsInABatch) {
  const View& view = world_->scene().views[0];
  const std::vector<Ray> rays = world_->make_batch(view, find_ray_kind("primary"), 33, 45)->rays();
  ASSERT_EQ(rays.size(), 33u * 45u);
  std::map<std::pair<float, float>, int> seen;
  for (const Ray& r : rays) {
    EXPECT_GT(r.t_max, 0);
    ++seen[{r.dir.x / r.dir.z, r.dir.y / r.dir.z}];
  }
  EXPECT_EQ(seen.size(), rays.size());
}

TEST_F(RayKinds, AViewOfNothingStartsNoRays) {
  View away = world_->scene().views[0];
  away.world_from_camera[3] = glm::dvec4(0, 1e4, 0, 1);
  away.world_from_camera = away.world_from_camera * glm::rotate(glm::dmat4(1), 1.57, glm::dvec3(1, 0, 0));
  for (const RayKind& kind : kRayKinds) {
    const auto batch = world_->make_batch(away, kind, 32, 32);
    EXPECT_EQ(batch->count(), kind.from_camera() ? 1024u : 0u) << kind.name;
    batch->fill_hits(kPattern);
    EXPECT_EQ(world_->trace(*batch, {}).dispatches, kind.from_camera() ? 1u : 0u);
    EXPECT_EQ(batch->hits().size(), batch->count());
    EXPECT_GT(world_->frame(*batch, {}).total_ms(), 0);
  }
}

// The batch has more rays than one dispatch takes on a CPU device, and so have its primary rays. Chunks must join
// without a gap.
TEST_F(RayKinds, LargeBatchesAreSplit) {
  if (!world_->device().is_cpu()) GTEST_SKIP() << "a GPU splits only batches of more than 2^24 rays";
  const MadeRays m = make(*world_, "secondary", 1090, 1001);
  const std::size_t n = m.grounds.size();
  EXPECT_GT(n, 900000u);
  ASSERT_EQ(m.batch->count(), 2 * n);
  expect_starts(*world_, std::span(m.rays).first(n), m.grounds, 1, 1);
  expect_starts(*world_, std::span(m.rays).subspan(n), m.grounds, 1, -1);
  m.batch->fill_hits(kPattern);
  EXPECT_GT(world_->trace(*m.batch, {}).dispatches, 1u);
  const std::vector<Hit> hits = m.batch->hits();
  EXPECT_EQ(count_untouched(hits), 0u);
  const auto foreign = world_->make_batch("rays.npy", m.rays, Want::Nearest);
  world_->trace(*foreign, {.method = "packet"});
  EXPECT_EQ(count_different(foreign->hits(), hits), 0u);
}

TEST_F(RayKinds, ForeignRaysAreTracedButHaveNoFrame) {
  const std::vector<Ray> rays = make(*world_, "diffuse", 32, 32).rays;
  const auto batch = world_->make_batch("rays.npy", rays, Want::Any);
  EXPECT_EQ(batch->name(), "rays.npy");
  EXPECT_TRUE(batch->any());
  EXPECT_EQ(batch->count(), rays.size());
  EXPECT_EQ(std::memcmp(batch->rays().data(), rays.data(), rays.size() * sizeof(Ray)), 0);
  EXPECT_FALSE(batch->has_frame());
  EXPECT_THROW(world_->frame(*batch, {}), Error);
  EXPECT_THROW(world_->trace(*batch, {.method = "none such"}), Error);
  EXPECT_EQ(world_->make_batch("nothing", {}, Want::Nearest)->count(), 0u);
}

// Every method and vote in the default mode; the plainest one in all. Methods.FindsWhatTheOracleFinds has the rest.
TEST_F(RayKinds, EveryMethodFindsWhatTheOracleFinds) {
  const Oracle oracle(world_->tracer().pair_tree(NodeLayout::Interleaved));
  for (const RayKind& kind : kRayKinds) {
    const auto batch = world_->make_batch(world_->scene().views[0], kind, 65, 39);
    const std::vector<Ray> rays = batch->rays();
    const auto truth = oracle.nearest(rays);
    for (const NumericMode& mode : kNumericModes) {
      std::vector<Hit> first;
      for (const Query& q : every_method(kind.want, mode.name)) {
        if (mode.name != kDefaultNumeric && q.method != kPlainestMethod) continue;
        batch->fill_hits(kPattern);
        world_->trace(*batch, q);
        const std::vector<Hit> hits = batch->hits();
        EXPECT_EQ(count_untouched(hits), 0u) << kind.name << ", " << world_->tracer().variant(q).name();
        const Judgement j = oracle.judge(rays, hits, truth, kind.want, judged_as(mode));
        EXPECT_EQ(j.errors(), 0u) << kind.name << ", " << world_->tracer().variant(q).name() << "\n  "
                                  << (j.examples.empty() ? "" : j.examples[0]);
        if (!mode.conservative || batch->any()) continue;
        if (first.empty()) first = hits;
        EXPECT_EQ(count_different(first, hits), 0u) << kind.name << ", bits, " << q.method;
      }
    }
  }
}

/// Returns a box about the origin that is scaled, turned and then moved. Side k has triangles 2k and 2k + 1.
Scene closed_box(const glm::dvec3& scale, double turn, const glm::dvec3& move) {
  glm::dmat4 place = glm::translate(glm::dmat4(1), move);
  place = glm::rotate(place, turn, glm::normalize(glm::dvec3(1, 2, 3)));
  place = glm::scale(place, scale);
  const auto at = [&](int axis, double w, double a, double b) {
    glm::dvec4 p(0, 0, 0, 1);
    p[axis] = w, p[(axis + 1) % 3] = a, p[(axis + 2) % 3] = b;
    return glm::vec3(glm::dvec3(place * p));
  };
  Scene scene;
  scene.name = "box";
  for (int axis = 0; axis < 3; ++axis)
    for (const double w : {-1., 1.}) {
      scene.triangles.push_back({at(axis, w, -1, -1), at(axis, w, 1, -1), at(axis, w, 1, 1)});
      scene.triangles.push_back({at(axis, w, -1, -1), at(axis, w, 1, 1), at(axis, w, -1, 1)});
    }
  View view;
  view.name = "inside";
  view.yfov = 2.5;
  view.world_from_camera = glm::translate(glm::dmat4(1), glm::dvec3(place * glm::dvec4(0.1, 0.2, 0.3, 1)));
  scene.views = {view};
  finish_scene(scene);
  return scene;
}

// Inside a convex body no ray hits the side that it leaves. Refracted rays are outside and hit nothing.
TEST_F(RayKinds, NoRayHitsTheSideThatItLeaves) {
  const struct {
    glm::dvec3 scale;
    double turn;
    glm::dvec3 move;
  } cases[] = {{{1, 1, 1}, 0, {0, 0, 0}},          {{1, 1, 1}, 0.7, {0, 0, 0}},
               {{100, 100, 100}, 2.1, {-3, 5, 9}}, {{1, 1, 1}, 0.7, {1, 1, 1}},
               {{1, 1, 1}, 0.7, {1e3, -7, 300}},   {{1e-3, 1e-3, 1e-3}, 1.3, {0, 0, 0}},
               {{1, 1, 0.002}, 0.7, {0, 0.5, 1}},  {{1, 0.01, 0.01}, 0, {0, 0, 0}}};
  world_.reset();
  for (const auto& c : cases) {
    const auto world = open(closed_box(c.scale, c.turn, c.move));
    const std::vector<Ground> grounds = grounds_of(*world, 128, 128);
    ASSERT_EQ(grounds.size(), 128u * 128u);
    for (const char* kind : {"reflect", "refract", "ao", "diffuse"})
      for (const NumericMode& mode : kNumericModes) {
        const auto batch = world->make_batch(world->scene().views[0], find_ray_kind(kind), 128, 128);
        world->trace(*batch, {.numeric = std::string(mode.name)});
        const std::vector<Hit> hits = batch->hits();
        std::size_t own = 0;
        for (std::size_t i = 0; i < hits.size(); ++i) {
          const Ground& g = grounds[i * grounds.size() / hits.size()];
          own += hits[i].prim != NO_HIT && (kind == std::string("refract") || hits[i].prim / 2 == g.prim / 2);
        }
        EXPECT_EQ(own, 0u) << kind << ", " << mode.name << ", scale " << c.scale.x << " to " << c.scale.z << ", turn "
                           << c.turn << ", at " << c.move.x;
      }
    EXPECT_EQ(world->messages(), std::vector<std::string>{});
  }
  SetUpTestSuite();
}

}  // namespace
}  // namespace ballot
