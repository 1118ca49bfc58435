// Boxes hold float32 triangles. A vertex is off by at most 2^-25 of its coordinate; boxes are widened by 2^-24 of the
// largest coordinate, as leaves may hold a part of a triangle, and by 64 * 2^-53 of the ray's distance from the scene
// for the 33 * 2^-53 by which a hit lies off its triangle (shaders/lib/numeric/triangle_double.glsl).
#include "engine/oracle/in_double.h"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>

#include "engine/oracle/oracle.h"
#include "engine/oracle/walker.h"

namespace ballot {

namespace {

double largest_number(const glm::dvec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

/// a * b - c * d with its exact sign. A fused multiply-add gives the errors of the products that the shader splits for.
double difference_of_exact_sign(double a, double b, double c, double d) {
  const double ab = a * b, cd = c * d, ab_low = std::fma(a, b, -ab), cd_low = std::fma(c, d, -cd);
  const double high = ab - cd, low = ab_low - cd_low;
  const double back = high - ab, low_back = low - ab_low;
  const double lost = (ab - (high - back)) - (cd + back);
  const double low_lost = (ab_low - (low - low_back)) - (cd_low + low_back);
  return (high + (lost + low)) + low_lost;
}

/// The rule of shaders/lib/query/crossing.glsl.
int side_sign(double side, double px, double py, double qx, double qy) {
  if (side != 0) return side > 0 ? 1 : -1;
  if (py != qy) return qy > py ? 1 : -1;
  return px > qx ? 1 : px < qx ? -1 : 0;
}

/// A ray turned so that its main axis comes last, that of its rounded direction as in the shader.
struct TurnedRay {
  explicit TurnedRay(const RayInDouble& ray) {
    const glm::vec3 a = glm::abs(glm::vec3(ray.dir));
    const int m = a.x >= a.y && a.x >= a.z ? 0 : a.y >= a.z ? 1 : 2;
    axes = {(m + 1) % 3, (m + 2) % 3, m};
    origin = turn(ray.origin);
    const glm::dvec3 d = turn(ray.dir);
    first = -d.x / d.z, second = -d.y / d.z, along = d.z;
  }
  glm::dvec3 turn(const glm::dvec3& v) const { return {v[axes[0]], v[axes[1]], v[axes[2]]}; }

  std::array<int, 3> axes{};
  glm::dvec3 origin{0};
  double first, second, along;
};

SightInDouble see(const TurnedRay& ray, const CornersInDouble& corners) {
  std::array<double, 3> x, y, z;
  for (std::size_t i = 0; i < 3; ++i) {
    const glm::dvec3 v = ray.turn(corners[i]) - ray.origin;
    x[i] = v.x + ray.first * v.z, y[i] = v.y + ray.second * v.z, z[i] = v.z;
  }
  std::array<double, 3> e;
  std::array<int, 3> sign;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t p = (i + 1) % 3, q = (i + 2) % 3;
    e[i] = difference_of_exact_sign(x[q], y[p], y[q], x[p]);
    sign[i] = side_sign(e[i], x[p], y[p], x[q], y[q]);
  }
  const double det = e[0] + e[1] + e[2], inverse = 1 / (det == 0 ? 1 : det);
  const double w0 = e[0] * inverse, u = e[1] * inverse, v = e[2] * inverse;
  SightInDouble s{(v * z[2] + (u * z[1] + w0 * z[0])) / ray.along, u, v};
  const auto [least, most] = std::minmax({e[0], e[1], e[2]});
  s.meets = (least >= 0 || most <= 0) && det != 0;
  s.crosses = sign[0] != 0 && sign[0] == sign[1] && sign[1] == sign[2] && det != 0;
  s.front = (sign[0] > 0) == (ray.along > 0);
  return s;
}

/// A ray on its way through boxes.
struct WalkedInDouble {
  WalkedInDouble(const RayInDouble& ray, const Bounds& scene, double largest_vertex)
      : o(ray.origin), d(ray.dir), t_min(ray.t_min) {
    for (int k = 0; k < 3; ++k) inverse_d[k] = 1 / d[k];
    const double reach =
        largest_number(glm::max(glm::abs(glm::dvec3(scene.lo) - o), glm::abs(glm::dvec3(scene.hi) - o)));
    pad = kRoundedToSingle * largest_vertex + 0x1p-46 * reach;
  }
  glm::dvec3 o, d, inverse_d{0};
  double t_min, pad;
};

std::optional<double> enter(const WalkedInDouble& ray, const Bounds& box, double t_far) {
  double near = ray.t_min, far = t_far;
  const double pad[3] = {ray.pad, ray.pad, ray.pad};
  if (!cut_to_box(ray, box, pad, near, far)) return std::nullopt;
  near -= 0x1p-48 * std::abs(near);
  far += 0x1p-48 * std::abs(far);
  return near <= far ? std::optional(near) : std::nullopt;
}

/// A point is a ray whose t are squares of distances (walker.h).
struct PointInDouble {
  glm::dvec3 at;
  double t_min = 0, pad = 0;
};

std::optional<double> enter(const PointInDouble& p, const Bounds& box, double far) {
  const glm::dvec3 out =
      glm::max(glm::max(glm::dvec3(box.lo) - p.pad - p.at, p.at - (glm::dvec3(box.hi) + p.pad)), glm::dvec3(0));
  const double square = glm::dot(out, out) * (1 - 0x1p-48);
  return square <= far ? std::optional(square) : std::nullopt;
}

/// The nearest point of a triangle to zero, by the weights of its vertices: of its inside, else of its edges.
struct Foot {
  glm::dvec3 at{0}, weights{0};
  double square = std::numeric_limits<double>::infinity();

  void take_edge(const std::array<glm::dvec3, 3>& v, int i, int j) {
    const glm::dvec3 edge = v[std::size_t(j)] - v[std::size_t(i)];
    const double length = glm::dot(edge, edge);
    const double part = length > 0 ? std::clamp(-glm::dot(v[std::size_t(i)], edge) / length, 0.0, 1.0) : 0;
    const glm::dvec3 foot = part < 0.5 ? v[std::size_t(i)] + part * edge : v[std::size_t(j)] - (1 - part) * edge;
    if (const double s = glm::dot(foot, foot); s < square) {
      square = s, at = foot, weights = glm::dvec3(0);
      weights[i] = 1 - part, weights[j] = part;
    }
  }
  void take_inside(const std::array<glm::dvec3, 3>& v) {
    const glm::dvec3 n = glm::cross(v[1] - v[0], v[2] - v[0]);
    const double area = glm::dot(n, n);
    glm::dvec3 sides;
    for (int i = 0; i < 3; ++i) {
      const glm::dvec3 &p = v[std::size_t(i + 1) % 3], &q = v[std::size_t(i + 2) % 3];
      sides[i] = glm::dot(n, glm::cross(q - p, -p));
    }
    if (!(area > 0) || sides.x < 0 || sides.y < 0 || sides.z < 0) return;
    const double depth = glm::dot(n, v[0]);
    if (const double s = depth * depth / area; s < square)
      square = s, at = n * (depth / area), weights = sides / (sides.x + sides.y + sides.z);
  }
};

}  // namespace

SightInDouble sight_in_double(const RayInDouble& ray, const CornersInDouble& corners) {
  return see(TurnedRay(ray), corners);
}

OracleInDouble::OracleInDouble(const PairTree& tree, std::span<const Triangle> triangles,
                               std::span<const CornersInDouble> corners)
    : tree_(tree), triangles_(triangles), corners_(corners) {
  if (!corners.empty())
    largest_ = std::max(largest_number(glm::dvec3(tree.bounds.lo)), largest_number(glm::dvec3(tree.bounds.hi)));
}

CornersInDouble OracleInDouble::corners(std::uint32_t prim) const {
  return corners_.empty() ? widened(triangles_[prim]) : corners_[prim];
}

OracleHit OracleInDouble::nearest(const RayInDouble& ray) const {
  OracleHit best;
  if (is_dead(ray)) return best;
  const TurnedRay turned(ray);
  double t_far = ray.t_max;
  Walker<PairTree> walker(tree_);
  walker.walk(WalkedInDouble(ray, tree_.bounds, largest_), t_far, [&](std::uint32_t texel) {
    const std::uint32_t prim = decode_prim(tree_, texel);
    const SightInDouble s = see(turned, corners(prim));
    if (!s.meets || s.t < ray.t_min || s.t > t_far) return true;
    if (best.prim == NO_HIT || s.t < best.t || prim < best.prim) best = {s.t, prim, s.u, s.v}, t_far = s.t;
    return true;
  });
  return best;
}

OracleHit OracleInDouble::brute_force(const RayInDouble& ray) const {
  OracleHit best;
  if (is_dead(ray)) return best;
  const TurnedRay turned(ray);
  for (std::uint32_t prim = 0; prim < triangles_.size(); ++prim) {
    const SightInDouble s = see(turned, corners(prim));
    if (!s.meets || s.t < ray.t_min || s.t > ray.t_max) continue;
    if (best.prim == NO_HIT || s.t < best.t) best = {s.t, prim, s.u, s.v};
  }
  return best;
}

std::vector<CrossingInDouble> OracleInDouble::list(const RayInDouble& given, const Keep& keep, std::size_t most,
                                                   bool last) const {
  std::vector<CrossingInDouble> found;
  if (is_dead(given) || most == 0) return found;
  const TurnedRay turned(given);
  // The last crossings are the first of the ray turned round.
  const RayInDouble ray = last ? RayInDouble{given.origin, -given.t_max, -given.dir, -given.t_min} : given;
  const auto before = [](const CrossingInDouble& a, const CrossingInDouble& b) {
    return a.t != b.t ? a.t < b.t : a.prim < b.prim;
  };
  double t_far = ray.t_max;
  Walker<PairTree> walker(tree_);
  walker.walk(WalkedInDouble(ray, tree_.bounds, largest_), t_far, [&](std::uint32_t texel) {
    const std::uint32_t prim = decode_prim(tree_, texel);
    const SightInDouble s = see(turned, corners(prim));
    if (!s.crosses || s.t < given.t_min || s.t > given.t_max || (keep && !keep(prim, s.front))) return true;
    const CrossingInDouble crossing{last ? -s.t : s.t, prim, s.u, s.v};
    const auto place = std::ranges::lower_bound(found, crossing, before);
    if (place != found.end() && place->prim == prim) return true;  // it lies in several leaves
    found.insert(place, crossing);
    if (found.size() > most) found.pop_back();
    if (found.size() == most) t_far = found.back().t;
    return true;
  });
  for (CrossingInDouble& c : found) c.t = last ? -c.t : c.t;
  return found;
}

ClosestInDouble OracleInDouble::closest(const glm::dvec3& point, double limit,
                                        const std::function<bool(std::uint32_t prim)>& keep) const {
  ClosestInDouble best;
  if (!(largest_number(point) <= double(std::numeric_limits<float>::max())) || !(limit >= 0)) return best;
  best.distance = limit;
  double far = limit * limit;
  Walker<PairTree> walker(tree_);
  walker.walk(PointInDouble{point, 0, kRoundedToSingle * largest_}, far, [&](std::uint32_t texel) {
    const std::uint32_t prim = decode_prim(tree_, texel);
    if (keep && !keep(prim)) return true;
    CornersInDouble v = corners(prim);
    for (glm::dvec3& corner : v) corner -= point;
    Foot foot;
    for (int i = 0; i < 3; ++i) foot.take_edge(v, i, (i + 1) % 3);
    foot.take_inside(v);
    const double distance = std::sqrt(foot.square);
    if (distance > best.distance || (distance == best.distance && prim > best.prim)) return true;
    best = {distance, prim, point + foot.at, foot.weights.y, foot.weights.z};
    far = distance * distance * (1 + 0x1p-50);
    return true;
  });
  if (best.prim == NO_HIT) best.distance = std::numeric_limits<double>::infinity();
  return best;
}

bool OracleInDouble::inside(const glm::dvec3& point) const {
  return list({point, 0, {1, 0, 0}, double(std::numeric_limits<float>::max())}).size() % 2 == 1;
}

}  // namespace ballot
