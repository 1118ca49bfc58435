// Finds nearest hits in double precision, over the arrays that are uploaded to the device.
#include "engine/oracle/oracle.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "engine/oracle/in_parallel.h"
#include "engine/oracle/sight.h"
#include "engine/oracle/walker.h"

namespace ballot {
namespace {

constexpr std::size_t kRaysPerOracleChunk = 4096;

// Returns ax * by - ay * bx. Where that cancels, it is computed again in long double. If a and b change places, only
// the sign of the result changes.
double cross(double ax, double ay, double bx, double by) {
  const double p = ax * by, q = ay * bx;
  const double difference = p - q;
  if (std::abs(difference) > 1e-12 * (std::abs(p) + std::abs(q))) return difference;
  return static_cast<double>(static_cast<long double>(ax) * by - static_cast<long double>(ay) * bx);
}

void take_nearer(OracleHit& best, const std::optional<OracleHit>& hit) {
  if (hit && (best.prim == NO_HIT || hit->t < best.t || (hit->t == best.t && hit->prim < best.prim))) best = *hit;
}

}  // namespace

bool is_dead(const Ray& ray) {
  const float all[] = {ray.origin.x, ray.origin.y, ray.origin.z, ray.t_min, ray.dir.x, ray.dir.y, ray.dir.z, ray.t_max};
  if (!std::all_of(std::begin(all), std::end(all), [](float x) { return std::isfinite(x); })) return true;
  const float longest = std::max({std::abs(ray.dir.x), std::abs(ray.dir.y), std::abs(ray.dir.z)});
  return longest < std::numeric_limits<float>::min() || ray.t_max <= ray.t_min;
}

bool is_dead(const RayInDouble& ray) {
  const Ray single{glm::vec3(ray.origin), float(ray.t_min), glm::vec3(ray.dir), float(ray.t_max)};
  if (!std::isfinite(single.t_min) || !std::isfinite(single.t_max) || ray.t_max <= ray.t_min) return true;
  return is_dead(Ray{single.origin, 0, single.dir, 1});
}

bool is_beyond_range(const Ray& ray, const Bounds& bounds, Arithmetic arithmetic) {
  if (is_dead(ray)) {
    const float longest = std::max({std::abs(ray.dir.x), std::abs(ray.dir.y), std::abs(ray.dir.z)});
    Ray longer = ray;
    longer.dir = glm::vec3(1);
    return longest > 0 && longest < std::numeric_limits<float>::min() && !is_dead(longer);
  }
  if (arithmetic == Arithmetic::Exact || arithmetic == Arithmetic::WoopInDouble) return false;
  double outside = 0, diagonal = 0;  // squares
  for (int k = 0; k < 3; ++k) {
    const double lo = bounds.lo[k], hi = bounds.hi[k], o = ray.origin[k];
    const double d = std::max({lo - o, o - hi, 0.0});
    outside += d * d;
    diagonal += (hi - lo) * (hi - lo);
  }
  return outside > kRangeDiagonals * kRangeDiagonals * diagonal;
}

// The pad covers the float32 rounding that the judge allows for (judge.cpp: 16 roundings of 2^-24 of the distance to a
// vertex) and the rounding of the origin. So no candidate close to a decision is culled.
RayFrame::RayFrame(const RayInDouble& ray, const Bounds& bounds) : t_min(ray.t_min), t_max(ray.t_max) {
  double reach = 0;
  for (int k = 0; k < 3; ++k) {
    o[k] = ray.origin[k];
    d[k] = ray.dir[k];
    inverse_d[k] = d[k] == 0 ? 0 : 1 / d[k];
    reach = std::max({reach, std::abs(bounds.lo[k] - o[k]), std::abs(bounds.hi[k] - o[k])});
  }
  for (int k = 0; k < 3; ++k) pad[k] = 24 * 0x1p-24 * reach + 0x1p-22 * std::abs(o[k]);
  kz = 0;
  for (int k = 1; k < 3; ++k)
    if (std::abs(d[k]) > std::abs(d[kz])) kz = k;
  kx = (kz + 1) % 3;
  ky = (kz + 2) % 3;
  sx = d[kx] / d[kz];
  sy = d[ky] / d[kz];
  sz = 1 / d[kz];
}

Sight::Sight(const RayFrame& ray, const Triangle& triangle) : reach(0) {
  for (int i = 0; i < 3; ++i) {
    const glm::vec3& vertex = triangle[static_cast<std::size_t>(i)];
    double v[3];
    for (int k = 0; k < 3; ++k) {
      v[k] = vertex[k] - ray.o[k];
      reach = std::max(reach, std::abs(v[k]));
    }
    x[i] = v[ray.kx] - ray.sx * v[ray.kz];
    y[i] = v[ray.ky] - ray.sy * v[ray.kz];
    z[i] = v[ray.kz] * ray.sz;
  }
  side[0] = cross(x[2], y[2], x[1], y[1]);
  side[1] = cross(x[0], y[0], x[2], y[2]);
  side[2] = cross(x[1], y[1], x[0], y[0]);
  det = side[0] + side[1] + side[2];
}

std::optional<OracleHit> intersect(const RayFrame& ray, const Triangle& triangle, std::uint32_t prim) {
  const Sight s(ray, triangle);
  const auto [least, most] = std::minmax({s.side[0], s.side[1], s.side[2]});
  if (least < 0 && most > 0) return std::nullopt;
  // A ray in the triangle's plane sees it edge-on. Then a det other than 0 only comes from the rounding of x and y.
  double width = 0;
  for (int i = 0; i < 3; ++i) width += std::abs(s.x[i]) + std::abs(s.y[i]);
  if (std::abs(s.det) <= 4 * std::numeric_limits<double>::epsilon() * s.reach * width) return std::nullopt;
  const double t = s.t();
  if (!(t >= ray.t_min && t <= ray.t_max)) return std::nullopt;
  return OracleHit{t, prim, s.weight(1), s.weight(2)};
}

std::optional<double> enter(const RayFrame& ray, const Bounds& box, double t_far) {
  double near = ray.t_min, far = t_far;
  return cut_to_box(ray, box, ray.pad, near, far) && near <= far ? std::optional(near) : std::nullopt;
}

OracleHit nearest_in(const PlacedMesh& mesh) {
  OracleHit best;
  if (is_dead(mesh.ray)) return best;
  const RayFrame frame(mesh.ray, mesh.tree.bounds);
  double t_far = frame.t_max;
  Walker(mesh.tree).walk(frame, t_far, [&](std::uint32_t texel) {
    take_nearer(best, intersect(frame, decode_triangle(mesh.tree, texel), decode_prim(mesh.tree, texel)));
    if (best.prim != NO_HIT) t_far = best.t;
    return true;
  });
  return best;
}

OracleHit Oracle::nearest(const Ray& ray) const { return is_dead(ray) ? OracleHit{} : scene_.nearest(ray, nearest_in); }

std::vector<OracleHit> Oracle::nearest(std::span<const Ray> rays) const {
  const std::size_t chunk = scene_.forest() ? kRaysOfInstances : kRaysPerOracleChunk;
  return hits_of(rays, chunk, [&](std::span<const Ray> some, std::span<OracleHit> hits) {
    for (std::size_t i = 0; i < some.size(); ++i) hits[i] = nearest(some[i]);
  });
}

OracleHit Oracle::brute_force(const Ray& ray) const {
  if (is_dead(ray)) return {};
  return scene_.nearest(ray, [](const PlacedMesh& mesh) {
    OracleHit best;
    if (is_dead(mesh.ray)) return best;
    const RayFrame frame(mesh.ray, mesh.tree.bounds);
    for_all_triangles(mesh.tree, [&](std::uint32_t texel) {
      take_nearer(best, intersect(frame, decode_triangle(mesh.tree, texel), decode_prim(mesh.tree, texel)));
    });
    return best;
  });
}

}  // namespace ballot
