#include "tools/bench/image_error.h"

#include <cmath>
#include <glm/geometric.hpp>

namespace ballot::bench {

namespace {

double shade(const DeviceScene& world, const Ray& ray, std::uint32_t prim) {
  if (prim >= world.triangle_count()) return 0;
  const Triangle t = world.triangle(prim);
  const glm::dvec3 a(t[0]), normal = glm::cross(glm::dvec3(t[1]) - a, glm::dvec3(t[2]) - a), dir(ray.dir);
  const double lengths = glm::length(normal) * glm::length(dir);
  return lengths > 0 ? std::abs(glm::dot(normal, dir)) / lengths : 0;
}

}  // namespace

double image_rmse(const DeviceScene& world, std::span<const Ray> rays, std::span<const Hit> answers,
                  std::span<const ExactHit> truth) {
  double squares = 0;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (answers[i].prim == truth[i].prim) continue;
    const double error = shade(world, rays[i], answers[i].prim) - shade(world, rays[i], truth[i].prim);
    squares += error * error;
  }
  return rays.empty() ? 0 : std::sqrt(squares / double(rays.size()));
}

}  // namespace ballot::bench
