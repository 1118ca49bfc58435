#include "engine/oracle/crossings.h"

#include <algorithm>
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

std::vector<ExactCrossing> sorted(const FilterRay& ray, std::vector<Crossed>& found) {
  std::ranges::sort(found, [](const Crossed& a, const Crossed& b) { return a.before(b); });
  // A triangle may lie in several leaves.
  const auto twice = std::ranges::unique(found, {}, &Crossed::prim);
  found.erase(twice.begin(), twice.end());
  std::vector<ExactCrossing> all;
  all.reserve(found.size());
  for (const Crossed& c : found) all.push_back(c.numbers(ray));
  return all;
}

}  // namespace

std::vector<ExactCrossing> ExactCrossings::list(const Ray& ray, const KeepCrossing& keep) const {
  if (is_dead(ray)) return {};
  const FilterRay filter(ray);
  std::vector<Crossed> found;
  Walker(bvh_).walk(filter, double(ray.t_max), [&](std::uint32_t texel) {
    const Triangle triangle = decode_triangle(bvh_, texel);
    const FilterSight sight(filter, triangle);
    if (!line_crosses(ray, triangle, sight)) return true;
    const std::uint32_t prim = decode_prim(bvh_, texel);
    if (keep && !keep(prim, is_front(ray, triangle, sight))) return true;
    Crossed crossed(ray, triangle, prim, sight);
    if (crossed.within()) found.push_back(std::move(crossed));
    return true;
  });
  return sorted(filter, found);
}

std::vector<ExactCrossing> ExactCrossings::in_order(const Ray& ray,
                                                    std::vector<std::pair<std::uint32_t, Triangle>> crossed) const {
  const FilterRay filter(ray);
  std::vector<Crossed> found;
  for (const auto& [prim, triangle] : crossed) found.emplace_back(ray, triangle, prim, FilterSight(filter, triangle));
  return sorted(filter, found);
}

bool ExactCrossings::inside(const glm::vec3& point) const {
  const Ray ray{point, 0, {1, 0, 0}, std::numeric_limits<float>::max()};
  if (is_dead(ray)) return false;
  const FilterRay filter(ray);
  std::vector<std::uint32_t> crossed;
  Walker(bvh_).walk(filter, double(ray.t_max), [&](std::uint32_t texel) {
    const Triangle triangle = decode_triangle(bvh_, texel);
    const FilterSight sight(filter, triangle);
    const Sure line = sight.crosses_line();
    if (line == Sure::No) return true;
    const Interval t = sight.t_bounds();
    if (t.high < 0) return true;
    const bool sure = line == Sure::Yes && t.low > 0;
    if (sure || exact_crosses_ahead(point, triangle)) crossed.push_back(decode_prim(bvh_, texel));
    return true;
  });
  std::ranges::sort(crossed);
  const auto twice = std::ranges::unique(crossed);
  return (crossed.size() - twice.size()) % 2 == 1;
}

}  // namespace ballot
