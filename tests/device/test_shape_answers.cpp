// Many rays at shapes of every kind, tangent ones among them: mode exact is right, and mode watertight within its bound
// (shaders/lib/shape/shapes.glsl). BALLOT_SHAPE_RAYS sets how many, and has the sums printed.
#include <atomic>
#include <cstdlib>

#include "engine/core/parallel.h"
#include "engine/scene/device_scene.h"
#include "tests/cpu/shape_judge.h"
#include "tests/device/crossing_test.h"

namespace ballot {
namespace {

using namespace test;
constexpr float kFarthest = 1e4f;
constexpr Number kWatertightUlps = 24, kExactUlps = 2;  // t itself is rounded

class ShapeAnswersTest : public CrossingTest {};

std::size_t wanted_rays() {
  const char* text = std::getenv("BALLOT_SHAPE_RAYS");
  return text ? std::size_t(std::atof(text)) : 0;
}

Transform leaning(float angle, float scale, glm::vec3 to, float stretch) {
  const float c = std::cos(angle) * scale, s = std::sin(angle) * scale;
  return {{{c, -s * stretch, 0, to.x}, {s, c * stretch, 0, to.y}, {0, 0, scale, to.z}}};
}

/// A scene of one kind, or of all kinds and triangles, with several instances of each.
Scene scene_for(std::optional<ShapeKind> kind, std::uint32_t seed) {
  if (kind) return scene_of({{*kind, random_shapes(*kind, 80, 0.2f, seed)}}, {{0}});
  std::vector<ShapeMesh> meshes{{ShapeKind::Triangles, {}, shapes::soup(40, 0.2f, seed)}};
  for (const ShapeKind k : {ShapeKind::Spheres, ShapeKind::Discs, ShapeKind::Capsules, ShapeKind::Boxes})
    meshes.push_back({k, random_shapes(k, 20, 0.15f, seed + std::uint32_t(k))});
  std::vector<Placement> placements;
  for (std::uint32_t m = 0; m < meshes.size(); ++m) {
    placements.push_back({m, {}});
    placements.push_back({m, leaning(0.4f + float(m), 0.8f, {0.3f, -0.2f, 0.1f}, m % 2 ? 1.6f : 1)});
  }
  return scene_of(std::move(meshes), std::move(placements));
}

/// Rays at shapes: at a point of each, at its rim, from far away, and from where `before` hit.
class RayMaker {
 public:
  RayMaker(const Scene& scene, std::uint32_t seed) : shapes_(scene.shapes), random_(seed) {}

  std::vector<Ray> make(std::size_t count, std::span<const Ray> before, std::span<const Hit> hits) {
    std::vector<Ray> rays;
    for (std::size_t i = 0; i < count; ++i) {
      Ray ray = at_shape(i);
      if (i % 8 == 7 && i < hits.size() && hits[i].prim != NO_HIT)
        ray.origin = before[i].origin + hits[i].t * before[i].dir, ray.t_min = i % 16 == 7 ? 0 : 1e-4f;
      if (i % 32 == 5) ray.t_max = 0.7f;
      rays.push_back(ray);
    }
    return rays;
  }

 private:
  Ray at_shape(std::size_t i) {
    const Shape& s = shapes_[random_.below(shapes_.size())];
    const glm::vec3 from = random_.point(i % 4 == 0 ? 1.f : i % 64 == 3 ? 300.f : 4.f);
    glm::vec3 to = glm::mix(glm::vec3(s.a), glm::vec3(s.b), i % 3 ? 0.f : random_.in(0, 1));
    if (i % 2) {  // to a tangent, off by some last bits
      const glm::vec3 across = glm::cross(to - from, random_.point(1));
      to += across * (s.a.w / std::max(glm::length(across), 1e-6f) * (1 + random_.in(-4, 4) * 0x1p-22f));
    } else {
      to += random_.point(0.2f);
    }
    return {from, 0, (to - from) * random_.in(0.05f, 4), kFarthest};
  }

  std::span<const Shape> shapes_;
  shapes::Random random_;
};

struct Sums {
  std::atomic<std::uint64_t> rays = 0, hits = 0, unlike = 0, faults = 0, exact_faults = 0, judged = 0;
};

/// Returns true if two hits of a ray are of one shape, and no farther apart than the bound allows.
bool alike(const Ray& ray, const Hit& a, const Hit& b) {
  if (a.prim != b.prim || a.prim == NO_HIT) return a.prim == b.prim;
  const glm::vec3 to = glm::abs(a.t * ray.dir);
  return std::abs(a.t - b.t) * glm::length(ray.dir) <= 20 * 0x1p-24f * std::max({to.x, to.y, to.z});
}

/// Compares the answers of mode watertight with those of mode exact. What is not alike is judged by brute force, and
/// one ray in 1024.
void judge(const OracleScene& scene, std::span<const Ray> rays, std::span<const Hit> exact, std::span<const Hit> usual,
           Sums& sums) {
  for_chunks(rays.size(), 1 << 10, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      ++sums.rays;
      sums.hits += exact[i].prim != NO_HIT;
      sums.unlike += exact[i].prim != usual[i].prim;
      if (alike(rays[i], exact[i], usual[i]) && i % 1024) continue;
      ++sums.judged;
      const std::string fault = fault_of(scene, rays[i], usual[i], kWatertightUlps);
      const std::string other = fault_of(scene, rays[i], exact[i], kExactUlps);
      if (!fault.empty() && ++sums.faults < 4) ADD_FAILURE() << "watertight, ray " << i << ": " << fault;
      if (!other.empty() && ++sums.exact_faults < 4) ADD_FAILURE() << "exact, ray " << i << ": " << other;
    }
  });
}

TEST_F(ShapeAnswersTest, WithinTheirBounds) {
  const std::size_t wanted = wanted_rays(), each = (wanted ? wanted : 20000) / 5,
                    chunk = std::min<std::size_t>(each, 1 << 17);
  for (int kind = 0; kind < 5; ++kind) {
    const std::optional<ShapeKind> one = kind ? std::optional(ShapeKind(kind)) : std::nullopt;
    const std::string name(one ? info_of(*one).name : "mixed");
    SCOPED_TRACE(name);
    Sums sums;
    std::vector<Ray> rays;
    std::vector<Hit> exact, usual;
    for (std::uint32_t seed = 1; sums.rays < each; ++seed) {
      DeviceSceneOptions options;
      options.context = gpu_;
      options.build.builder = BuilderId::Balanced;
      options.use_cache = false;
      DeviceScene world(scene_for(one, seed), options);
      rays = RayMaker(world.scene(), seed + 1000).make(chunk, rays, exact);
      exact.resize(chunk), usual.resize(chunk);
      world.trace(rays, exact, {.numeric = "exact"});
      world.trace(rays, usual, {.method = seed % 2 ? "auto" : "while-while"});
      judge(world.tracer().tree().oracle_scene(), rays, exact, usual, sums);
      if (testing::Test::HasFailure()) break;
    }
    EXPECT_GT(sums.hits, sums.rays / 4);
    if (wanted)
      fmt::print("{}: {} rays, {} hits; unlike exact {}, judged {}, beyond the bound {}; exact wrong {}\n", name,
                 sums.rays.load(), sums.hits.load(), sums.unlike.load(), sums.judged.load(), sums.faults.load(),
                 sums.exact_faults.load());
  }
}

}  // namespace
}  // namespace ballot
