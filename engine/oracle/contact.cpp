#include "engine/oracle/contact.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "engine/oracle/sight.h"
#include "engine/oracle/walker.h"

namespace ballot {

namespace {

double largest(const glm::dvec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

/// The first contact of an ideal ray.
struct Contact {
  double t;
  Triangle triangle;
};

std::optional<Contact> first_contact(const PairTree& bvh, const glm::dvec3& from, const Departure& departure) {
  Ray ideal = departure.ray;
  ideal.origin = glm::vec3(from);
  ideal.t_min = 0;
  RayFrame frame(ideal, bvh.bounds);  // its pad covers the rounding of the origin to float32
  for (int k = 0; k < 3; ++k) frame.o[k] = from[k];
  frame.t_min = 0x1p-40 * largest(from) / largest(glm::dvec3(ideal.dir));
  double t_far = frame.t_max;
  std::optional<Contact> first;
  Walker(bvh).walk(frame, t_far, [&](std::uint32_t texel) {
    const std::uint32_t prim = decode_prim(bvh, texel);
    if (prim == departure.hit.prim) return true;
    const Triangle triangle = decode_triangle(bvh, texel);
    const auto hit = intersect(frame, triangle, prim);
    if (hit && hit->t <= t_far) {
      t_far = hit->t;
      first = {hit->t, triangle};
    }
    return true;
  });
  return first;
}

}  // namespace

glm::dvec3 surface_point(const Departure& departure, const Triangle& triangle) {
  Ray endless = departure.primary;
  endless.t_max = std::numeric_limits<float>::max();
  const RayFrame frame(endless, Bounds{});
  if (const auto hit = intersect(frame, triangle, departure.hit.prim))
    return glm::dvec3(endless.origin) + hit->t * glm::dvec3(endless.dir);
  const double u = departure.hit.u, v = departure.hit.v;
  return glm::dvec3(triangle[0]) * (1 - u - v) + glm::dvec3(triangle[1]) * u + glm::dvec3(triangle[2]) * v;
}

bool loses_contact(const PairTree& bvh, const Departure& departure, const Triangle& triangle) {
  const auto contact = first_contact(bvh, surface_point(departure, triangle), departure);
  if (!contact) return false;
  const glm::dvec3 corner(contact->triangle[0]);
  const glm::dvec3 normal =
      glm::cross(glm::dvec3(contact->triangle[1]) - corner, glm::dvec3(contact->triangle[2]) - corner);
  const Ray& ray = departure.ray;
  const double t = glm::dot(normal, corner - glm::dvec3(ray.origin)) / glm::dot(normal, glm::dvec3(ray.dir));
  return t < ray.t_min;
}

}  // namespace ballot
