#include "engine/oracle/error_reasons.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "engine/core/error.h"
#include "engine/oracle/predicates.h"
#include "engine/oracle/ulp.h"

namespace ballot {
namespace {

// The name of the edge opposite to vertex i: the numbers of its two vertices.
constexpr const char* kEdges[] = {"1-2", "2-0", "0-1"};

// The distances of the ray's line from the lines of the three edges, in scene units, for a triangle with det != 0. A
// distance is negative if the ray passes outside of its edge. side = d . (p_b x p_c) is the triple product of d, the
// edge and any vector between the two lines.
struct Distances {
  Distances(const Ray& ray, const Triangle& triangle, const ExactSight& sight) {
    const Dyadic one(1.f);
    const glm::dvec3 d(ray.dir);
    for (int i = 0; i < 3; ++i) {
      const auto b = static_cast<std::size_t>((i + 1) % 3), c = static_cast<std::size_t>((i + 2) % 3);
      const double across = glm::length(glm::cross(d, glm::dvec3(triangle[c]) - glm::dvec3(triangle[b])));
      const double side = quotient(sight.side[i], one) * sight.det.sign();
      at[i] = across > 0 ? side / across : 0;
    }
  }
  int least() const { return static_cast<int>(std::min_element(at, at + 3) - at); }
  double at[3];
};

// Returns a clause that compares the ray's distance from an edge with the bound of the rounding error. The clause is
// empty if the arithmetic is exact.
std::string share_of_bound(const ReasonSources& from, const Ray& ray, std::uint32_t prim, int edge) {
  if (from.arithmetic == Arithmetic::Exact) return "";
  return fmt::format(", {:.2g} of what {} may move it", from.bound.allowance(ray, prim, from.arithmetic).edge[edge],
                     from.arithmetic == Arithmetic::WoopInDouble ? "float64" : "float32");
}

std::string outside_interval(const Ray& ray, std::uint32_t prim, double t) {
  const bool before = t <= ray.t_min;
  const double end = before ? ray.t_min : ray.t_max;
  return fmt::format("prim {} lies at t {}, {:.2g} ulp {} {}", prim, t, in_ulps(std::abs(t - end), end),
                     before ? "before t_min" : "beyond t_max", end);
}

std::string why_not_hit(const ReasonSources& from, const Ray& ray, std::uint32_t prim) {
  const std::optional<Triangle> triangle = from.exact.triangle(prim);
  if (is_dead(ray)) return "the ray is dead";
  if (!triangle) return fmt::format("no leaf of the hierarchy holds prim {}", prim);
  const ExactSight sight(ray, *triangle);
  if (sight.det.sign() == 0) return fmt::format("the ray is parallel to prim {}, or that has no area", prim);
  if (sight.hits_line()) return outside_interval(ray, prim, sight.t());
  const Distances distances(ray, *triangle, sight);
  const int edge = distances.least();
  return fmt::format("the ray passes {:.2g} outside edge {} of prim {}{}", -distances.at[edge], kEdges[edge], prim,
                     share_of_bound(from, ray, prim, edge));
}

std::string how_it_is_hit(const ReasonSources& from, const Ray& ray, std::uint32_t prim) {
  const Triangle triangle = *from.exact.triangle(prim);
  const ExactSight sight(ray, triangle);
  const auto zeros = std::count_if(sight.side, sight.side + 3, [](const Dyadic& s) { return s.sign() == 0; });
  if (zeros > 0)
    return fmt::format("the ray passes exactly through {} of prim {}", zeros > 1 ? "a vertex" : "an edge", prim);
  const Distances distances(ray, triangle, sight);
  const int edge = distances.least();
  return fmt::format("the ray passes {:.2g} inside edge {} of prim {}{}", distances.at[edge], kEdges[edge], prim,
                     share_of_bound(from, ray, prim, edge));
}

std::string why_wrong_prim(const ReasonSources& from, const Ray& ray, std::uint32_t named, const ExactHit& truth) {
  if (!from.exact.hits(ray, named)) return fmt::format("{}; prim {} is hit", why_not_hit(from, ray, named), truth.prim);
  const double apart =
      t_apart(ExactSight(ray, *from.exact.triangle(truth.prim)), ExactSight(ray, *from.exact.triangle(named)));
  return fmt::format("prims {} and {} lie {:.2g} ulp of t apart, prim {} behind; {}", truth.prim, named,
                     in_ulps(apart, truth.t), named, how_it_is_hit(from, ray, truth.prim));
}

std::string why_wrong_value(const ReasonSources& from, const Ray& ray, const Hit& answer) {
  if (std::isnan(answer.t) || std::isnan(answer.u) || std::isnan(answer.v)) return "t, u or v is NaN";
  if (answer.t < ray.t_min || answer.t > ray.t_max) return outside_interval(ray, answer.prim, answer.t);
  const ExactHit own = from.exact.hit(ray, answer.prim);
  return fmt::format("t is {:.3g} ulp off, where the bound is {:.3g}; u is {:.2g} off, v {:.2g}",
                     in_ulps(std::abs(answer.t - own.t), own.t),
                     in_ulps(from.bound.allowance(ray, answer.prim, from.arithmetic).t, own.t),
                     std::abs(answer.u - own.u), std::abs(answer.v - own.v));
}

}  // namespace

std::string reason_of(const ReasonSources& from, const ErrorCase& error) {
  switch (error.kind) {
    case ErrorKind::FalseMiss:
      return how_it_is_hit(from, error.ray, error.truth.prim);
    case ErrorKind::FalseHit:
      return why_not_hit(from, error.ray, error.answer.prim);
    case ErrorKind::WrongPrim:
      return why_wrong_prim(from, error.ray, error.answer.prim, error.truth);
    case ErrorKind::WrongValue:
      return why_wrong_value(from, error.ray, error.answer);
  }
  return "";
}

}  // namespace ballot
