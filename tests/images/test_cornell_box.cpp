// Compares two path traced pictures of a box with coloured walls, a block and a lamp: one by Ballot and one by a path
// tracer in this file. The latter shares no code with Ballot. It computes in double precision, tests every triangle,
// and uses no shadow rays, no Russian roulette and no weights of multiple importance sampling.
#include <random>

#include "tests/images/pictures.h"

namespace ballot::test {
namespace {

constexpr std::uint32_t kSize = 12;

void add_quad(Scene& scene, glm::vec3 a, glm::vec3 b, glm::vec3 c, glm::vec3 d, std::uint32_t material) {
  scene.triangles.push_back({a, b, c});
  scene.triangles.push_back({a, c, d});
  scene.material_of.insert(scene.material_of.end(), 2, material);
}

Scene cornell_box() {
  Scene scene;
  scene.name = "box";
  scene.materials = {{.name = "white", .base_color = glm::vec3(0.73f)},
                     {.name = "red", .base_color = {0.63f, 0.06f, 0.05f}},
                     {.name = "green", .base_color = {0.12f, 0.45f, 0.09f}},
                     {.name = "lamp", .base_color = glm::vec3(0.5f), .emissive = {9, 7, 5}}};
  add_quad(scene, {-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1}, 0);
  add_quad(scene, {-1, -1, -1}, {1, -1, -1}, {1, -1, 1}, {-1, -1, 1}, 0);
  add_quad(scene, {-1, 1, -1}, {1, 1, -1}, {1, 1, 1}, {-1, 1, 1}, 0);
  add_quad(scene, {-1, -1, -1}, {-1, 1, -1}, {-1, 1, 1}, {-1, -1, 1}, 1);
  add_quad(scene, {1, -1, -1}, {1, 1, -1}, {1, 1, 1}, {1, -1, 1}, 2);
  add_quad(scene, {-0.5f, 0.98f, -0.5f}, {0.5f, 0.98f, -0.5f}, {0.5f, 0.98f, 0.5f}, {-0.5f, 0.98f, 0.5f}, 3);
  // A block: its top and the two sides that the camera sees.
  add_quad(scene, {-0.6f, -0.3f, -0.5f}, {0, -0.3f, -0.7f}, {0.2f, -0.3f, -0.1f}, {-0.4f, -0.3f, 0.1f}, 0);
  add_quad(scene, {-0.4f, -1, 0.1f}, {0.2f, -1, -0.1f}, {0.2f, -0.3f, -0.1f}, {-0.4f, -0.3f, 0.1f}, 0);
  add_quad(scene, {0.2f, -1, -0.1f}, {0, -1, -0.7f}, {0, -0.3f, -0.7f}, {0.2f, -0.3f, -0.1f}, 0);
  scene.views.push_back(view_from({0, 0, 2.8}));
  finish_scene(scene);
  return scene;
}

/// The nearest hit of a ray, or t = 1e30 for a miss.
struct Found {
  double t = 1e30;
  std::size_t prim = 0;
  glm::dvec3 normal{0};
};

/// Finds the nearest hit by a test of every triangle.
Found nearest(const Scene& scene, const glm::dvec3& from, const glm::dvec3& dir) {
  Found best;
  for (std::size_t i = 0; i < scene.triangles.size(); ++i) {
    const glm::dvec3 a(scene.triangles[i][0]), b(scene.triangles[i][1]), c(scene.triangles[i][2]);
    const glm::dvec3 n = glm::cross(b - a, c - a);
    const double t = glm::dot(n, a - from) / glm::dot(n, dir);
    if (!(t > 1e-7 && t < best.t)) continue;
    const glm::dvec3 p = from + dir * t;
    if (glm::dot(glm::cross(b - a, p - a), n) < 0 || glm::dot(glm::cross(c - b, p - b), n) < 0 ||
        glm::dot(glm::cross(a - c, p - c), n) < 0)
      continue;
    best = {t, i, glm::normalize(n)};
  }
  return best;
}

/// Estimates the radiance along a ray by one random path of up to 8 bounces.
glm::dvec3 radiance(const Scene& scene, glm::dvec3 from, glm::dvec3 dir, std::mt19937_64& random) {
  std::uniform_real_distribution<double> uniform;
  glm::dvec3 sum(0), weight(1);
  for (int depth = 0; depth <= 8; ++depth) {
    const Found hit = nearest(scene, from, dir);
    if (hit.t >= 1e30) break;
    const Material& m = scene.materials[scene.material(hit.prim)];
    sum += weight * glm::dvec3(m.emissive);
    weight *= glm::dvec3(m.base_color);
    const glm::dvec3 n = glm::dot(hit.normal, dir) > 0 ? -hit.normal : hit.normal;
    from += dir * hit.t;
    glm::dvec3 ball;  // normalised and added to the normal, it gives a cosine-distributed direction
    do {
      ball = {2 * uniform(random) - 1, 2 * uniform(random) - 1, 2 * uniform(random) - 1};
    } while (glm::dot(ball, ball) > 1 || glm::dot(ball, ball) < 1e-6);
    dir = glm::normalize(n + glm::normalize(ball));
  }
  return sum;
}

// Each pixel agrees within 5 standard errors of both pictures together, and the mean of the picture within 2 %.
TEST(CornellBox, AgreesWithAnIndependentPathTracer) {
  constexpr int kSamples = 600;
  const Scene scene = cornell_box();
  DeviceScene world(scene, with_validation());
  const Picture p = render(
      world, scene.views[0],
      {.width = kSize, .height = kSize, .spp = 1024, .shading = "path", .aovs = {"color", "variance"}, .bounces = 8});
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> uniform;
  double ours = 0, theirs = 0;
  for (std::uint32_t y = 0; y < kSize; ++y)
    for (std::uint32_t x = 0; x < kSize; ++x) {
      double sum = 0, squares = 0;
      for (int i = 0; i < kSamples; ++i) {
        const glm::dvec2 at = plane_point(scene.views[0], x + uniform(random), y + uniform(random), kSize, kSize);
        const double g = radiance(scene, {0, 0, 2.8}, glm::normalize(glm::dvec3(at, -1)), random).g;
        sum += g;
        squares += g * g;
      }
      const double mean = sum / kSamples, variance = (squares / kSamples - mean * mean) / kSamples;
      const double error = std::sqrt(variance + double(p.at("variance.G", x, y)));
      EXPECT_NEAR(p.at("G", x, y), mean, 5 * error + 2e-3) << x << ", " << y;
      ours += p.at("G", x, y);
      theirs += mean;
    }
  EXPECT_NEAR(ours / theirs, 1, 0.02);
}

}  // namespace
}  // namespace ballot::test
