#include "engine/render/batch/origins.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "engine/core/error.h"
#include "engine/core/parallel.h"
#include "engine/oracle/contact.h"

namespace ballot {

namespace {

constexpr std::size_t kRaysPerOriginsChunk = 1024;

/// Returns the float32 unit in the last place at a magnitude.
double ulp_of(double magnitude) {
  return std::ldexp(1.0, std::max(std::ilogb(std::max(magnitude, 0x1p-126)), -126) - 23);
}

OriginCheck check_one(const PairTree& bvh, const Scene& scene, const Departure& departure, std::uint32_t found,
                      bool to_light) {
  const std::uint32_t prim = departure.hit.prim;
  const Triangle& triangle = scene.triangles[prim];
  const glm::dvec3 point = surface_point(departure, triangle), size = glm::abs(point);
  const double offset = glm::distance(glm::dvec3(departure.ray.origin), point);
  const bool into = to_light && goes_behind(triangle, departure.primary, departure.ray);
  return {.self_hit = found == prim && !into,
          .lost_contact = loses_contact(bvh, departure, triangle),
          .offset = offset,
          .ulps = offset / ulp_of(std::max({size.x, size.y, size.z}))};
}

}  // namespace

bool goes_behind(const Triangle& triangle, const Ray& primary, const Ray& ray) {
  const glm::dvec3 corner(triangle[0]), dir(ray.dir);
  const glm::dvec3 normal = glm::cross(glm::dvec3(triangle[1]) - corner, glm::dvec3(triangle[2]) - corner);
  const double ahead = glm::dot(normal, dir), seen = -glm::dot(normal, glm::dvec3(primary.dir));
  return ahead * (seen < 0 ? -1 : 1) < -0x1p-19 * glm::length(normal) * glm::length(dir);
}

std::vector<OriginCheck> check_origins(Tracer& tracer, Batches& batches, const Scene& scene, const RayBatch& batch,
                                       const Query& query) {
  const std::vector<RayStart> starts = batch.starts();
  if (starts.size() != batch.count())
    fail(Failure::Arguments, "rays '{}' start at no hits, so no offset can be checked", batch.name());
  const std::vector<Ray> rays = batch.rays();
  const auto again = batches.make(batch.name(), rays, Want::Nearest);
  batches.trace(*again, query);
  const std::vector<Hit> hits = again->hits();
  const bool to_light = batch.name() == "shadow";
  const PairTree& bvh = tracer.pair_tree(NodeLayout::Interleaved);
  std::vector<OriginCheck> checks(rays.size());
  for_chunks(rays.size(), kRaysPerOriginsChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      checks[i] = check_one(bvh, scene, {starts[i].primary, starts[i].hit, rays[i]}, hits[i].prim, to_light);
  });
  return checks;
}

}  // namespace ballot
