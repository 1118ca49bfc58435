#include "engine/oracle/crossings.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "engine/oracle/filter.h"
#include "engine/oracle/filter_box.h"
#include "engine/oracle/nearest.h"
#include "engine/oracle/oracle.h"
#include "engine/oracle/walker.h"

namespace ballot {
namespace {

/// A triangle that the line of a ray crosses. Its exact numbers are computed on first use.
class Crossed {
 public:
  Crossed(const Ray& ray, const Triangle& triangle, std::uint32_t prim, const FilterSight& sight)
      : ray_(&ray), triangle_(triangle), prim_(prim), t_(sight.t_bounds()) {}

  const ExactSight& exact() const {
    if (!exact_) exact_ = std::make_unique<ExactSight>(*ray_, triangle_);
    return *exact_;
  }
  bool within() const {
    if (t_.high < ray_->t_min || t_.low > ray_->t_max) return false;
    return (t_.low >= ray_->t_min && t_.high <= ray_->t_max) || exact().within(*ray_);
  }
  bool before(const Crossed& other) const {
    if (t_.high < other.t_.low) return true;
    if (t_.low > other.t_.high) return false;
    if (prim_ == other.prim_) return false;
    const std::strong_ordering order = compare_t(exact(), other.exact());
    return order < 0 || (order == 0 && prim_ < other.prim_);
  }
  std::uint32_t prim() const { return prim_; }

  ExactCrossing numbers(const FilterRay& ray) const {
    constexpr double kFine = 0x1p-31;
    double u, v;
    const bool sure = FilterSight(ray, triangle_).weights(u, v, kFine);
    if (!sure) u = exact().weight(1), v = exact().weight(2);
    const double middle = 0.5 * t_.low + 0.5 * t_.high;
    return {t_.high - t_.low <= kFine * std::abs(middle) ? middle : exact().t(), prim_, u, v};
  }

 private:
  const Ray* ray_;
  Triangle triangle_;
  std::uint32_t prim_;
  Interval t_;
  mutable std::unique_ptr<ExactSight> exact_;
};

bool line_crosses(const Ray& ray, const Triangle& triangle, const FilterSight& sight) {
  const Sure sure = sight.crosses_line();
  return sure == Sure::Unsure ? exact_crosses(ray, triangle, ExactSight(ray, triangle)) : sure == Sure::Yes;
}

/// Returns true if the ray comes from the side on which the vertices of the triangle run counter-clockwise. The ray's
/// line crosses the triangle.
bool is_front(const Ray& ray, const Triangle& triangle, const FilterSight& sight) {
  const int sign = sight.side_of_plane();
  return (sign == 0 ? ExactSight(ray, triangle).det.sign() : sign) < 0;
}

/// Adds the crossings of a mesh to those of the scene, in order.
void add_sorted(const PlacedMesh& mesh, const FilterRay& ray, std::vector<Crossed>& found,
                std::vector<ExactCrossing>& all) {
  std::ranges::sort(found, [](const Crossed& a, const Crossed& b) { return a.before(b); });
  // A triangle may lie in several leaves.
  const auto same = [](const Crossed& a, const Crossed& b) { return a.prim() == b.prim(); };
  found.erase(std::unique(found.begin(), found.end(), same), found.end());
  all.reserve(all.size() + found.size());
  for (const Crossed& c : found) {
    ExactCrossing& made = all.emplace_back(c.numbers(ray));
    made.t *= mesh.scale;
    made.prim += mesh.first;
  }
}

/// Merges the crossings of several instances by t in float32. They come one instance after the other, each one's in
/// exact order, in which they stay. `ends` tells where those of each end.
void merge(std::vector<ExactCrossing>& all, std::span<const std::size_t> ends) {
  if (ends.size() < 2) return;
  std::vector<std::pair<float, std::size_t>> order;  // a key that grows within each instance, and the place
  std::size_t i = 0;
  for (const std::size_t end : ends)
    for (float last = -INFINITY; i < end; ++i) order.emplace_back(last = std::max(last, float(all[i].t)), i);
  std::ranges::stable_sort(order, {}, &std::pair<float, std::size_t>::first);
  std::vector<ExactCrossing> merged;
  merged.reserve(all.size());
  for (const auto& [key, place] : order) merged.push_back(all[place]);
  all = std::move(merged);
}

/// Returns whether the ray from a point along +x crosses the triangles of a tree an odd number of times.
bool is_inside(const PairTree& tree, const glm::vec3& point) {
  const Ray ray{point, 0, {1, 0, 0}, std::numeric_limits<float>::max()};
  if (is_dead(ray)) return false;
  const FilterRay filter(ray);
  std::vector<std::uint32_t> crossed;
  Walker(tree).walk(filter, double(ray.t_max), [&](std::uint32_t texel) {
    const Triangle triangle = decode_triangle(tree, texel);
    const FilterSight sight(filter, triangle);
    const Sure line = sight.crosses_line();
    if (line == Sure::No) return true;
    const Interval t = sight.t_bounds();
    if (t.high < 0) return true;
    const bool sure = line == Sure::Yes && t.low > 0;
    if (sure || exact_crosses_ahead(point, triangle)) crossed.push_back(decode_prim(tree, texel));
    return true;
  });
  std::ranges::sort(crossed);
  return (std::unique(crossed.begin(), crossed.end()) - crossed.begin()) % 2 == 1;
}

}  // namespace

std::vector<ExactCrossing> ExactCrossings::list(const Ray& ray, const KeepCrossing& keep) const {
  if (is_dead(ray)) return {};
  std::vector<ExactCrossing> all;
  std::vector<std::size_t> ends;
  scene_.for_each(ray, [&](const PlacedMesh& mesh) {
    if (is_dead(mesh.ray)) return;
    const Ray moved = rounded(mesh.ray);  // which is float32
    const FilterRay filter(moved);
    std::vector<Crossed> found;
    Walker(mesh.tree).walk(filter, double(moved.t_max), [&](std::uint32_t texel) {
      const Triangle triangle = decode_triangle(mesh.tree, texel);
      const FilterSight sight(filter, triangle);
      if (!line_crosses(moved, triangle, sight)) return true;
      const std::uint32_t prim = decode_prim(mesh.tree, texel);
      if (keep && !keep(mesh.first + prim, is_front(moved, triangle, sight) != mesh.mirrors)) return true;
      Crossed crossed(moved, triangle, prim, sight);
      if (crossed.within()) found.push_back(std::move(crossed));
      return true;
    });
    add_sorted(mesh, filter, found, all);
    ends.push_back(all.size());
  });
  merge(all, ends);
  return all;
}

std::vector<ExactCrossing> ExactCrossings::in_order(const Ray& ray, std::vector<std::uint32_t> prims) const {
  std::ranges::sort(prims);
  std::vector<ExactCrossing> all;
  std::vector<std::size_t> ends;
  for (std::size_t i = 0; i < prims.size();) {
    const PlacedMesh mesh = scene_.mesh_of(ray, prims[i]);
    const Ray moved = rounded(mesh.ray);
    const FilterRay filter(moved);
    std::vector<Crossed> found;
    for (; i < prims.size() && prims[i] - mesh.first < mesh.triangles.size(); ++i) {
      const Triangle& triangle = mesh.triangles[prims[i] - mesh.first];
      found.emplace_back(moved, triangle, prims[i] - mesh.first, FilterSight(filter, triangle));
    }
    add_sorted(mesh, filter, found, all);
    ends.push_back(all.size());
  }
  merge(all, ends);
  return all;
}

bool ExactCrossings::inside(const glm::vec3& point) const {
  bool inside = false;
  scene_.for_each_around(
      point, [&](std::size_t mesh, const glm::vec3& at) { inside = inside != is_inside(*scene_.trees()[mesh], at); });
  return inside;
}

}  // namespace ballot
