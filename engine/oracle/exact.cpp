#include "engine/oracle/exact.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "engine/core/error.h"
#include "engine/oracle/filter.h"
#include "engine/oracle/filter_box.h"
#include "engine/oracle/in_parallel.h"
#include "engine/oracle/oracle.h"
#include "engine/oracle/predicates.h"
#include "engine/oracle/shape_sight.h"
#include "engine/oracle/ulp.h"
#include "engine/oracle/walker.h"

namespace ballot {
namespace {

constexpr std::size_t kRaysPerExactChunk = 1024;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

ExactHit as_hit(const ExactSight& sight, std::uint32_t prim) {
  return {sight.t(), prim, sight.weight(1), sight.weight(2)};
}

// A triangle that the ray may hit. Its exact numbers are computed on first use.
class HitCandidate {
 public:
  HitCandidate(const RayInDouble& ray, const Triangle& triangle, std::uint32_t prim)
      : ray_(&ray), triangle_(triangle), prim_(prim) {}

  const ExactSight& exact() {
    if (!exact_) exact_.emplace(*ray_, triangle_);
    return *exact_;
  }
  // Narrows the interval of t to the neighbours of the double next to the exact t. det must not be 0.
  void narrow() {
    if (narrow_) return;
    narrow_ = true;
    const double t = exact().t();
    t_ = {std::nextafter(t, -kInfinity), std::nextafter(t, kInfinity)};
  }
  std::uint32_t prim() const { return prim_; }
  const Interval& t() const { return t_; }
  void set_t(const Interval& t) { t_ = t; }

 private:
  const RayInDouble* ray_;
  Triangle triangle_;
  std::uint32_t prim_;
  Interval t_{-kInfinity, kInfinity};
  bool narrow_ = false;
  std::optional<ExactSight> exact_;
};

// Finds the nearest hits of rays in a mesh, one ray after the other. Not thread-safe.
class Search {
 public:
  /// Of the triangles, those in `lost` are in no leaf.
  Search(const PairTree& bvh, std::span<const std::uint32_t> lost, ExactCounts& counts)
      : bvh_(bvh), lost_(lost), walker_(bvh), counts_(counts) {}

  ExactHit nearest(const RayInDouble& ray, std::span<const Triangle> triangles) {
    if (is_dead(ray)) return {};
    const FilterRay filter(ray);
    best_.reset();
    double t_far = ray.t_max;
    walker_.walk(filter, t_far, [&](std::uint32_t texel) {
      test(ray, filter, decode_triangle(bvh_, texel), decode_prim(bvh_, texel));
      if (best_) t_far = std::min(t_far, best_->t().high);
      return true;
    });
    for (const std::uint32_t prim : lost_) test(ray, filter, triangles[prim], prim);
    return best_ ? as_hit(best_->exact(), best_->prim()) : ExactHit{};
  }

 private:
  void test(const RayInDouble& ray, const FilterRay& filter, const Triangle& triangle, std::uint32_t prim) {
    ++counts_.triangle_tests;
    const FilterSight sight(filter, triangle);
    const Sure line = sight.hits_line();
    if (line == Sure::No) return;
    HitCandidate candidate(ray, triangle, prim);
    if (best_ && best_->prim() == candidate.prim()) return;
    candidate.set_t(sight.t_bounds());
    const Interval& t = candidate.t();
    if (t.high < ray.t_min || t.low > ray.t_max || (best_ && t.low > best_->t().high)) return;
    if (line == Sure::Unsure) {
      ++counts_.side_failures;
      if (!candidate.exact().hits_line()) return;
    }
    if (!(t.low >= ray.t_min && t.high <= ray.t_max)) {
      ++counts_.interval_failures;
      if (!candidate.exact().within(ray)) return;
      candidate.narrow();
    }
    if (!best_ || nearer(candidate)) best_ = std::move(candidate);
  }

  // True if the candidate comes before the best hit so far.
  bool nearer(HitCandidate& candidate) {
    if (candidate.t().high < best_->t().low) return true;
    if (candidate.t().low > best_->t().high) return false;
    ++counts_.order_failures;
    const std::strong_ordering order = compare_t(candidate.exact(), best_->exact());
    const bool comes_first = order < 0 || (order == 0 && candidate.prim() < best_->prim());
    (comes_first ? candidate : *best_).narrow();
    return comes_first;
  }

  const PairTree& bvh_;
  std::span<const std::uint32_t> lost_;
  Walker<PairTree> walker_;
  std::optional<HitCandidate> best_;
  ExactCounts& counts_;
};

/// Searches in all meshes that rays meet, one ray after the other. Not thread-safe.
class Searches {
 public:
  /// `lost`: the triangles of each mesh that are in no leaf.
  Searches(const OracleScene& scene, std::span<const std::vector<std::uint32_t>> lost)
      : scene_(scene), lost_(lost), of_(scene.trees().size()) {}

  ExactHit nearest(const Ray& ray) {
    ++counts_.rays;
    if (is_dead(ray)) return {};
    return scene_.nearest(ray, [&](const PlacedMesh& mesh) {
      if (mesh.kind != ShapeKind::Triangles) return nearest_shape(mesh);
      std::unique_ptr<Search>& search = of_[mesh.mesh];
      if (!search) search = std::make_unique<Search>(mesh.tree, lost_[mesh.mesh], counts_);
      return search->nearest(mesh.ray, mesh.triangles);
    });
  }
  const ExactCounts& counts() const { return counts_; }

 private:
  const OracleScene& scene_;
  std::span<const std::vector<std::uint32_t>> lost_;
  std::vector<std::unique_ptr<Search>> of_;  // each mesh
  ExactCounts counts_;
};

}  // namespace

ExactCounts& ExactCounts::operator+=(const ExactCounts& other) {
  rays += other.rays;
  triangle_tests += other.triangle_tests;
  side_failures += other.side_failures;
  interval_failures += other.interval_failures;
  order_failures += other.order_failures;
  return *this;
}

ExactCounts operator-(const ExactCounts& a, const ExactCounts& b) {
  return {a.rays - b.rays, a.triangle_tests - b.triangle_tests, a.side_failures - b.side_failures,
          a.interval_failures - b.interval_failures, a.order_failures - b.order_failures};
}

ExactOracle::ExactOracle(OracleScene scene) : scene_(std::move(scene)) {
  for (std::size_t mesh = 0; mesh < scene_.trees().size(); ++mesh) {
    std::vector<std::uint32_t>& lost = lost_.emplace_back();
    const std::span<const Triangle> triangles = scene_.triangles(mesh);
    for (std::uint32_t prim = 0; prim < triangles.size(); ++prim)
      if (scene_.leaf_texel_of(mesh, prim) == NO_HIT && has_area(triangles[prim])) lost.push_back(prim);
  }
}

ExactHit ExactOracle::nearest(const Ray& ray) const {
  Searches searches(scene_, lost_);
  const ExactHit hit = searches.nearest(ray);
  add(searches.counts());
  return hit;
}

std::vector<ExactHit> ExactOracle::nearest(std::span<const Ray> rays, const Progress& progress) const {
  const auto find = [&](std::span<const Ray> some, std::span<ExactHit> hits) {
    Searches searches(scene_, lost_);
    for (std::size_t i = 0; i < some.size(); ++i) hits[i] = searches.nearest(some[i]);
    add(searches.counts());
  };
  return hits_of(rays, scene_.forest() ? kRaysOfInstances : kRaysPerExactChunk, find, progress);
}

ExactHit ExactOracle::brute_force(const Ray& ray) const {
  if (is_dead(ray)) return {};
  return scene_.nearest(ray, [&](const PlacedMesh& mesh) {
    if (is_dead(mesh.ray)) return ExactHit{};
    std::optional<ExactSight> best;
    std::uint32_t best_prim = NO_HIT;
    const auto test = [&](const Triangle& triangle, std::uint32_t prim) {
      const ExactSight sight(mesh.ray, triangle);
      if (!sight.hits_line() || !sight.within(mesh.ray)) return;
      const std::strong_ordering order = best ? ballot::compare_t(sight, *best) : std::strong_ordering::less;
      if (order > 0 || (order == 0 && prim >= best_prim)) return;
      best = sight;
      best_prim = prim;
    };
    for_all_triangles(mesh.tree, [&](std::uint32_t texel) {
      test(decode_triangle(mesh.tree, texel), decode_prim(mesh.tree, texel));
    });
    for (const std::uint32_t prim : lost_[mesh.mesh]) test(mesh.triangles[prim], prim);
    return best ? as_hit(*best, best_prim) : ExactHit{};
  });
}

ExactHit ExactOracle::hit(const Ray& ray, std::uint32_t prim) const {
  const std::optional<Triangle> shape = triangle(prim);
  if (!shape || is_dead(ray)) return {};
  const PlacedMesh mesh = scene_.mesh_of(ray, prim);
  if (is_dead(mesh.ray)) return {};
  ExactHit hit;
  if (mesh.kind != ShapeKind::Triangles) {
    hit = nearest_shape(mesh, prim - mesh.first);
  } else if (const ExactSight sight(mesh.ray, *shape); sight.hits_line() && sight.within(mesh.ray)) {
    hit = as_hit(sight, prim);
  }
  if (hit.prim == NO_HIT) return {};
  hit.prim = prim;
  hit.t *= mesh.scale;
  return hit;
}

std::strong_ordering ExactOracle::compare_t(const Ray& ray, std::uint32_t prim_a, std::uint32_t prim_b) const {
  const auto sight_of = [&](std::uint32_t prim) {
    const std::optional<Triangle> shape = triangle(prim);
    if (!shape || is_dead(ray))
      fail(Failure::Arguments, "exact oracle: t of prim {} was asked for, but {}; compare what the ray hits", prim,
           shape ? "the ray is dead" : "no leaf of the hierarchy holds it");
    ExactSight sight(scene_.mesh_of(ray, prim).ray, *shape);
    if (sight.det.sign() == 0)
      fail(Failure::Arguments, "exact oracle: the ray is parallel to prim {}, so there is no t; compare what it hits",
           prim);
    return sight;
  };
  return ballot::compare_t(sight_of(prim_a), sight_of(prim_b));
}

bool ExactOracle::ties(const Ray& ray, const ExactHit& a, const ExactHit& b, Arithmetic arithmetic) const {
  if (scene_.place_of(a.prim).first != scene_.place_of(b.prim).first)
    return in_ulps(std::abs(a.t - b.t), b.t) <= (arithmetic == Arithmetic::Exact ? 2 : 0);
  return compare_t(ray, a.prim, b.prim) == 0;
}

std::optional<Triangle> ExactOracle::triangle(std::uint32_t prim) const {
  if (!scene_.may_have(prim)) return std::nullopt;
  const auto [mesh, first] = scene_.place_of(prim);
  const std::uint32_t own = prim - first, texel = scene_.leaf_texel_of(mesh, own);
  if (std::ranges::binary_search(lost_[mesh], own)) return scene_.triangles(mesh)[own];
  if (texel == NO_HIT) return std::nullopt;
  return decode_triangle(*scene_.trees()[mesh], texel);
}

void ExactOracle::add(const ExactCounts& counts) const {
  totals_[0] += counts.rays;
  totals_[1] += counts.triangle_tests;
  totals_[2] += counts.side_failures;
  totals_[3] += counts.interval_failures;
  totals_[4] += counts.order_failures;
}

ExactCounts ExactOracle::counts() const { return {totals_[0], totals_[1], totals_[2], totals_[3], totals_[4]}; }

}  // namespace ballot
