#include "engine/oracle/forest_oracle.h"

#include <limits>

#include "engine/core/error.h"
#include "engine/core/parallel.h"
#include "engine/oracle/instance_walk.h"

namespace ballot {

namespace {

constexpr std::size_t kRaysAtOnce = 256;

bool is_error(Verdict v) { return v != Verdict::Same && v != Verdict::Tie; }

}  // namespace

ForestOracle::ForestOracle(const Forest& forest) : forest_(forest) {
  for (const MeshTree& mesh : forest.meshes())
    trees_.push_back(encode_pairs(mesh.bvh, mesh.triangles, NodeLayout::Interleaved));
  for (const PairTree& tree : trees_) oracles_.emplace_back(tree);
}

OracleHit ForestOracle::nearest(const Ray& ray) const {
  return nearest_of_instances<OracleHit>(forest_, oracles_, ray);
}

Verdict ForestOracle::judge(const Ray& ray, const Hit& answer, Want want, Arithmetic arithmetic) const {
  const std::vector<Instance>& instances = forest_.instances();
  if (answer.prim != NO_HIT && (is_dead(ray) || answer.prim >= forest_.triangle_count())) return Verdict::FalseHit;
  if (answer.prim == NO_HIT && answer.t != std::numeric_limits<float>::infinity()) return Verdict::WrongT;
  if (is_dead(ray)) return Verdict::Same;
  Verdict verdict = Verdict::Same;
  const auto with = [&](const Instance& i, const Ray& object, const Hit& given) {
    const Verdict one = oracles_[i.mesh].judge(object, given, oracles_[i.mesh].nearest(object), want, arithmetic);
    if (one != Verdict::Same && !is_error(verdict)) verdict = one;
  };
  double before = 0;  // t on the scale of object-space rays that no other instance's hit may be before
  std::size_t named = instances.size();
  if (answer.prim != NO_HIT) {
    const Forest::Place at = forest_.place_of(answer.prim);
    const Instance& i = instances[named = at.instance];
    const Ray object = object_ray(ray, i.map);
    const Hit given{answer.t / direction_scale(ray), at.triangle, answer.u, answer.v};
    with(i, object, given);
    if (is_error(verdict) || want == Want::Any) return verdict;
    before = double(given.t) - oracles_[i.mesh].allowance(object, at.triangle, arithmetic).t;
  }
  for (std::size_t k = 0; k < instances.size() && !is_error(verdict); ++k) {
    if (k == named || surely_misses(instances[k], forest_.meshes()[instances[k].mesh].extents, ray)) continue;
    Ray object = object_ray(ray, instances[k].map);
    if (named < instances.size()) object.t_max = float(before);
    with(instances[k], object, {std::numeric_limits<float>::infinity(), NO_HIT, 0, 0});
    if (verdict == Verdict::FalseMiss && named < instances.size()) verdict = Verdict::WrongPrim;
  }
  return verdict;
}

Verdict ForestOracle::judge_values(const Ray& ray, const Hit& answer, const OracleHit& own,
                                   Arithmetic arithmetic) const {
  const Forest::Place at = forest_.place_of(answer.prim);
  const Instance& i = forest_.instances()[at.instance];
  const double scale = direction_scale(ray);
  const Hit given{float(double(answer.t) / scale), at.triangle, answer.u, answer.v};
  return oracles_[i.mesh].judge(object_ray(ray, i.map), given, {own.t / scale, at.triangle, own.u, own.v},
                                Want::Nearest, arithmetic);
}

std::vector<OracleHit> ForestOracle::nearest(std::span<const Ray> rays) const {
  std::vector<OracleHit> hits(rays.size());
  for_chunks(rays.size(), kRaysAtOnce, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) hits[i] = nearest(rays[i]);
  });
  return hits;
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

}  // namespace ballot
