#include "engine/oracle/forest_exact.h"

#include <cmath>
#include <mutex>

#include "engine/core/parallel.h"
#include "engine/oracle/error_findings.h"
#include "engine/oracle/error_reasons.h"
#include "engine/oracle/instance_walk.h"

namespace ballot {
namespace {

constexpr std::size_t kForestRaysAtOnce = 256;
constexpr double kTieUlps = 2;

class ForestJudge {
 public:
  ForestJudge(const ForestExact& exact, const ForestOracle& bound, Want want, Arithmetic arithmetic)
      : exact_(exact), bound_(bound), want_(want), arithmetic_(arithmetic) {}

  Finding find(const Ray& ray, const Hit& answer, const ExactHit& truth) const {
    const Finding finding = find_in_range(ray, answer, truth);
    if (finding.wrong.has_value() == is_dead(ray)) return finding;  // right on a live ray, or a hit of a dead one
    return is_beyond_range(ray, exact_.forest().top_facts().bounds, arithmetic_) ? Finding{.beyond_range = true}
                                                                                 : finding;
  }

 private:
  Finding find_in_range(const Ray& ray, const Hit& answer, const ExactHit& truth) const {
    if (answer.prim == NO_HIT && truth.prim == NO_HIT) return {};
    if (answer.prim == NO_HIT) return wrong(ErrorKind::FalseMiss, ray, answer);
    if (answer.prim >= exact_.forest().triangle_count() || truth.prim == NO_HIT)
      return wrong(ErrorKind::FalseHit, ray, answer);
    if (answer.prim == truth.prim) return check_values(ray, answer, truth, false);
    const ExactHit own = exact_.hit(ray, answer.prim);
    if (own.prim == NO_HIT) return wrong(ErrorKind::WrongPrim, ray, answer);
    if (want_ == Want::Any) return check_values(ray, answer, own, false);
    if (!ties(ray, own, truth)) return wrong(ErrorKind::WrongPrim, ray, answer);
    return check_values(ray, answer, own, true);
  }

  bool ties(const Ray& ray, const ExactHit& a, const ExactHit& b) const {
    const Forest::Place at = exact_.forest().place_of(a.prim), other = exact_.forest().place_of(b.prim);
    if (at.instance == other.instance) return exact_.compare_t(ray, at, other) == 0;
    return in_ulps(std::abs(a.t - b.t), b.t) <= (arithmetic_ == Arithmetic::Exact ? kTieUlps : 0);
  }

  Finding wrong(ErrorKind kind, const Ray& ray, const Hit& answer) const {
    const Verdict verdict = bound_.judge(ray, answer, want_, arithmetic_);
    const bool covered = verdict == Verdict::Tie || verdict == Verdict::Same;
    return {.wrong = kind, .within_bound = covered && arithmetic_ != Arithmetic::Exact};
  }

  Finding check_values(const Ray& ray, const Hit& answer, const ExactHit& own, bool tie) const {
    Finding finding;
    finding.tie = tie;
    const double error = in_ulps(std::abs(answer.t - own.t), own.t);
    if (std::isfinite(error)) finding.t_ulp = error;
    if (bound_.judge_values(ray, answer, rounded(own), arithmetic_) == Verdict::Same) return finding;
    finding.tie = false;
    finding.wrong = ErrorKind::WrongValue;
    return finding;
  }

  const ForestExact& exact_;
  const ForestOracle& bound_;
  Want want_;
  Arithmetic arithmetic_;
};

std::string place_text(const Forest& forest, std::uint32_t prim) {
  if (prim >= forest.triangle_count()) return "no triangle";
  const Forest::Place at = forest.place_of(prim);
  return fmt::format("triangle {} of instance {}", at.triangle, at.instance);
}

}  // namespace

ForestExact::ForestExact(const Forest& forest) : forest_(forest) {
  for (const MeshTree& mesh : forest.meshes())
    trees_.push_back(encode_pairs(mesh.bvh, mesh.triangles, NodeLayout::Interleaved));
  for (std::size_t m = 0; m < trees_.size(); ++m) oracles_.emplace_back(trees_[m], forest.meshes()[m].triangles);
}

ExactHit ForestExact::nearest(const Ray& ray) const { return nearest_of_instances<ExactHit>(forest_, oracles_, ray); }

std::vector<ExactHit> ForestExact::nearest(std::span<const Ray> rays, const Progress& progress) const {
  std::vector<ExactHit> hits(rays.size());
  std::size_t done = 0;
  std::mutex mutex;
  for_chunks(rays.size(), kForestRaysAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) hits[i] = nearest(rays[i]);
    const std::lock_guard lock(mutex);
    done += end - begin;
    if (progress) progress(double(done) / double(rays.size()));
  });
  return hits;
}

ExactHit ForestExact::hit(const Ray& ray, std::uint32_t prim) const {
  const Forest::Place at = forest_.place_of(prim);
  const Instance& i = forest_.instances()[at.instance];
  ExactHit hit = oracles_[i.mesh].hit(object_ray(ray, i.map), at.triangle);
  if (hit.prim == NO_HIT) return hit;
  hit.t *= double(direction_scale(ray));
  hit.prim = prim;
  return hit;
}

std::strong_ordering ForestExact::compare_t(const Ray& ray, const Forest::Place& a, const Forest::Place& b) const {
  const Instance& i = forest_.instances()[a.instance];
  return oracles_[i.mesh].compare_t(object_ray(ray, i.map), a.triangle, b.triangle);
}

ExactCounts ForestExact::counts() const {
  ExactCounts sum;
  for (const ExactOracle& oracle : oracles_) sum += oracle.counts();
  return sum;
}

ErrorFigures forest_error_figures(const ForestExact& exact, const ForestOracle& bound, std::span<const Ray> rays,
                                  std::span<const Hit> answers, std::span<const ExactHit> truth, Want want,
                                  Arithmetic arithmetic, std::size_t max_cases) {
  const ForestJudge judge(exact, bound, want, arithmetic);
  return figures_of(judge, {rays, answers, truth}, max_cases, [&](const ErrorCase& e) {
    const Forest& forest = exact.forest();
    if (e.answer.prim == NO_HIT) return fmt::format("the ray hits {}", place_text(forest, e.truth.prim));
    const std::string named = place_text(forest, e.answer.prim);
    if (e.truth.prim == NO_HIT || e.kind == ErrorKind::WrongValue) return fmt::format("the answer names {}", named);
    return fmt::format("the answer names {}; right is {}", named, place_text(forest, e.truth.prim));
  });
}

}  // namespace ballot
