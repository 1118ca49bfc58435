#include "engine/oracle/forest_oracle.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/core/error.h"
#include "engine/oracle/error_findings.h"
#include "engine/oracle/in_parallel.h"

namespace ballot {

namespace {

constexpr std::size_t kRaysAtOnce = 256;

bool is_error(Verdict v) { return v != Verdict::Same && v != Verdict::Tie; }

/// Returns true if the ray misses the instance's box, widened 16 times as far as the proof of that box asks, and by a
/// 1000th of its size: the oracles shall find the errors of that proof, should there be some.
bool surely_misses(const Instance& instance, const MeshExtents& mesh, const Ray& ray) {
  if (mesh.empty) return true;
  const Bounds& b = instance.box;
  double far = 0, size = 0;
  for (int k = 0; k < 3; ++k) {
    const double o = ray.origin[k];
    far = std::max({far, std::abs(double(b.lo[k]) - o), std::abs(double(b.hi[k]) - o)});
    size = std::max(size, double(b.hi[k]) - double(b.lo[k]));
  }
  const double pad = 16 * double(instance.slack) * far + size / 1024;
  double near = -INFINITY, beyond = INFINITY;
  for (int k = 0; k < 3; ++k) {
    const double lo = double(b.lo[k]) - ray.origin[k] - pad, hi = double(b.hi[k]) - ray.origin[k] + pad;
    const double d = ray.dir[k];
    if (std::abs(d) < 1e-200) {
      if (lo > 0 || hi < 0) return true;
      continue;
    }
    near = std::max(near, std::min(lo / d, hi / d));
    beyond = std::min(beyond, std::max(lo / d, hi / d));
  }
  return near > beyond || beyond < ray.t_min || near > ray.t_max;
}

/// Returns the nearest hit of a ray: among the hits of instances, each by nearest(instance, object-space ray), that of
/// the smallest t; at equal t of the first instance.
template <class HitOf, class Nearest>
HitOf nearest_of(const Forest& forest, const Ray& ray, const Nearest& nearest) {
  HitOf best;
  if (is_dead(ray)) return best;
  for (const Instance& i : forest.instances()) {
    if (surely_misses(i, forest.meshes()[i.mesh].extents, ray)) continue;
    HitOf hit = nearest(i, object_ray(ray, i.map));
    if (hit.prim == NO_HIT) continue;
    hit.t *= double(direction_scale(ray));
    hit.prim += i.first;
    if (best.prim == NO_HIT || hit.t < best.t) best = hit;
  }
  return best;
}

std::string place_text(const Forest& forest, std::uint32_t prim) {
  if (prim >= forest.triangle_count()) return "no triangle";
  const Forest::Place at = forest.place_of(prim);
  return fmt::format("triangle {} of instance {}", at.triangle, at.instance);
}

}  // namespace

OracleHit ForestOracle::nearest(const Ray& ray) const {
  return nearest_of<OracleHit>(forest(), ray,
                               [&](const Instance& i, const Ray& object) { return oracle(i).nearest(object); });
}

Verdict ForestOracle::judge(const Ray& ray, const Hit& answer, Want want, Arithmetic arithmetic) const {
  const std::vector<Instance>& instances = forest().instances();
  if (answer.prim != NO_HIT && (is_dead(ray) || answer.prim >= forest().triangle_count())) return Verdict::FalseHit;
  if (answer.prim == NO_HIT && answer.t != std::numeric_limits<float>::infinity()) return Verdict::WrongT;
  if (is_dead(ray)) return Verdict::Same;
  Verdict verdict = Verdict::Same;
  const auto with = [&](const Instance& i, const Ray& object, const Hit& given) {
    const Verdict one = oracle(i).judge(object, given, oracle(i).nearest(object), want, arithmetic);
    if (one != Verdict::Same && !is_error(verdict)) verdict = one;
  };
  double before = 0;  // t on the scale of object-space rays that no other instance's hit may be before
  std::size_t named = instances.size();
  if (answer.prim != NO_HIT) {
    const Forest::Place at = forest().place_of(answer.prim);
    const Instance& i = instances[named = at.instance];
    const Ray object = object_ray(ray, i.map);
    const Hit given{answer.t / direction_scale(ray), at.triangle, answer.u, answer.v};
    with(i, object, given);
    if (is_error(verdict) || want == Want::Any) return verdict;
    before = double(given.t) - oracle(i).allowance(object, at.triangle, arithmetic).t;
  }
  for (std::size_t k = 0; k < instances.size() && !is_error(verdict); ++k) {
    if (k == named || surely_misses(instances[k], forest().meshes()[instances[k].mesh].extents, ray)) continue;
    Ray object = object_ray(ray, instances[k].map);
    if (named < instances.size()) object.t_max = float(before);
    with(instances[k], object, {std::numeric_limits<float>::infinity(), NO_HIT, 0, 0});
    if (verdict == Verdict::FalseMiss && named < instances.size()) verdict = Verdict::WrongPrim;
  }
  return verdict;
}

Verdict ForestOracle::judge_values(const Ray& ray, const Hit& answer, const OracleHit& own, Want,
                                   Arithmetic arithmetic) const {
  const Forest::Place at = forest().place_of(answer.prim);
  const Instance& i = forest().instances()[at.instance];
  const double scale = direction_scale(ray);
  const Hit given{float(double(answer.t) / scale), at.triangle, answer.u, answer.v};
  return oracle(i).judge(object_ray(ray, i.map), given, {own.t / scale, at.triangle, own.u, own.v}, Want::Nearest,
                         arithmetic);
}

std::vector<OracleHit> ForestOracle::nearest(std::span<const Ray> rays) const {
  return hits_of<OracleHit>(rays, kRaysAtOnce, [&](std::span<const Ray> some, std::span<OracleHit> hits) {
    for (std::size_t i = 0; i < some.size(); ++i) hits[i] = nearest(some[i]);
  });
}

Judgement ForestOracle::judge(std::span<const Ray> rays, std::span<const Hit> answers, Want want,
                              Arithmetic arithmetic) const {
  if (rays.size() != answers.size())
    fail(Failure::Arguments, "oracle: {} rays and {} answers; their numbers must agree", rays.size(), answers.size());
  std::vector<Verdict> verdicts(rays.size());
  for_chunks(rays.size(), kRaysAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) verdicts[i] = judge(rays[i], answers[i], want, arithmetic);
  });
  Judgement sum;
  for (std::size_t i = 0; i < verdicts.size(); ++i) {
    sum.add(verdicts[i]);
    if (!is_error(verdicts[i]) || sum.examples.size() >= 3) continue;
    const OracleHit truth = nearest(rays[i]);
    sum.examples.push_back(fmt::format("ray {}: verdict {}; answer t {} prim {}, truth t {} prim {}", i,
                                       int(verdicts[i]), answers[i].t, answers[i].prim, truth.t, truth.prim));
  }
  return sum;
}

ExactHit ForestExact::nearest(const Ray& ray) const {
  return nearest_of<ExactHit>(forest(), ray,
                              [&](const Instance& i, const Ray& object) { return oracle(i).nearest(object); });
}

std::vector<ExactHit> ForestExact::nearest(std::span<const Ray> rays, const Progress& progress) const {
  const auto find = [&](std::span<const Ray> some, std::span<ExactHit> hits) {
    for (std::size_t i = 0; i < some.size(); ++i) hits[i] = nearest(some[i]);
  };
  return hits_of<ExactHit>(rays, kRaysAtOnce, find, progress);
}

ExactHit ForestExact::hit(const Ray& ray, std::uint32_t prim) const {
  if (prim >= forest().triangle_count()) return {};
  const Forest::Place at = forest().place_of(prim);
  const Instance& i = instance(at.instance);
  ExactHit hit = oracle(i).hit(object_ray(ray, i.map), at.triangle);
  if (hit.prim == NO_HIT) return hit;
  hit.t *= double(direction_scale(ray));
  hit.prim = prim;
  return hit;
}

bool ForestExact::ties(const Ray& ray, const ExactHit& a, const ExactHit& b, Arithmetic arithmetic) const {
  const Forest::Place at = forest().place_of(a.prim), other = forest().place_of(b.prim);
  if (at.instance != other.instance)
    return in_ulps(std::abs(a.t - b.t), b.t) <= (arithmetic == Arithmetic::Exact ? 2 : 0);
  const Instance& i = instance(at.instance);
  return oracle(i).compare_t(object_ray(ray, i.map), at.triangle, other.triangle) == 0;
}

ExactCounts ForestExact::counts() const {
  ExactCounts sum;
  for (const ExactOracle& each : oracles()) sum += each.counts();
  return sum;
}

ErrorFigures error_figures(const ForestExact& exact, const ForestOracle& bound, std::span<const Ray> rays,
                           std::span<const Hit> answers, std::span<const ExactHit> truth, Want want,
                           Arithmetic arithmetic, std::size_t max_cases) {
  return figures_of(Judge(exact, bound, want, arithmetic), {rays, answers, truth}, max_cases, [&](const ErrorCase& e) {
    const Forest& forest = exact.forest();
    if (e.answer.prim == NO_HIT) return fmt::format("the ray hits {}", place_text(forest, e.truth.prim));
    const std::string named = place_text(forest, e.answer.prim);
    if (e.truth.prim == NO_HIT || e.kind == ErrorKind::WrongValue) return fmt::format("the answer names {}", named);
    return fmt::format("the answer names {}; right is {}", named, place_text(forest, e.truth.prim));
  });
}

}  // namespace ballot
