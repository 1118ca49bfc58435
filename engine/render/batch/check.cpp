#include "engine/render/batch/check.h"

#include <algorithm>
#include <cstring>

#include "engine/core/stopwatch.h"
#include "engine/render/batch/origins.h"

namespace ballot {

namespace {

// No kernel writes a hit of these bytes: the prim is larger than in any scene.
constexpr std::uint8_t kPattern = 0xA5;

bool untouched(const Hit& hit) {
  Hit pattern;
  std::memset(static_cast<void*>(&pattern), kPattern, sizeof pattern);
  return std::memcmp(&hit, &pattern, sizeof hit) == 0;
}

/// Oracles look at plain boxes here, whichever ones the traces that they judge read.
OracleScene scene_of(Tracer& tracer) {
  DeviceTree& tree = tracer.tree();
  const Forest* forest = tree.forest();
  if (!forest) return {tracer.pair_tree(NodeLayout::Interleaved), tree.triangles()};
  std::vector<const PairTree*> pairs;
  for (std::size_t mesh = 0; mesh < forest->meshes().size(); ++mesh)
    pairs.push_back(&tree.mesh_pairs(mesh, NodeLayout::Interleaved, Padding::Ray));
  return {*forest, std::move(pairs)};
}

}  // namespace

HitChecker::HitChecker(Tracer& tracer, Batches& batches)
    : batches_(batches), oracle_(scene_of(tracer)), exact_(oracle_.scene()) {}

std::optional<Triangle> HitChecker::triangle(std::uint32_t prim) const {
  const Forest* forest = exact_.scene().forest();
  return forest ? forest->triangle(forest->place_of(prim)) : exact_.triangle(prim);
}

Truth HitChecker::truth(const RayBatch& batch) const {
  Truth truth{batch.rays(), {}};
  truth.hits = oracle_.nearest(truth.rays);
  return truth;
}

std::vector<Hit> HitChecker::trace_over_pattern(RayBatch& batch, const Query& query) const {
  batch.fill_hits(kPattern);
  batches_.trace(batch, query);
  return batch.hits();
}

HitCheck HitChecker::check(RayBatch& batch, const Truth& truth, const Query& query) const {
  const std::vector<Hit> hits = trace_over_pattern(batch, query);
  const Arithmetic as = judged_as(find_numeric(query.numeric));
  return {oracle_.judge(truth.rays, hits, truth.hits, batch.want(), as),
          std::uint64_t(std::ranges::count_if(hits, untouched))};
}

ExactTruth HitChecker::exact_truth(const RayBatch& batch, const Progress& progress) const {
  ExactTruth truth{batch.rays(), {}, {}, 0};
  const ExactCounts before = exact_.counts();
  const Timer timer;
  truth.hits = exact_.nearest(truth.rays, progress);
  truth.seconds = timer.seconds();
  truth.counts = exact_.counts() - before;
  return truth;
}

ErrorFigures HitChecker::judge(std::span<const Ray> rays, std::span<const Hit> answers, const ExactTruth& truth,
                               const Query& query, std::size_t max_cases) const {
  const Arithmetic as = find_numeric(query.numeric).arithmetic;
  if (as == Arithmetic::WoopInDouble && exact_.scene().forest()) {
    const ExactOracle in_double(exact_.scene().in_double());
    return error_figures(in_double, oracle_, rays, answers, in_double.nearest(rays), query.want, as, max_cases);
  }
  return error_figures(exact_, oracle_, rays, answers, truth.hits, query.want, as, max_cases);
}

ErrorFigures HitChecker::verify(RayBatch& batch, const ExactTruth& truth, const Query& query,
                                std::size_t max_cases) const {
  const std::vector<Hit> hits = trace_over_pattern(batch, query);
  Query as = query;
  as.want = batch.want();
  ErrorFigures figures = judge(truth.rays, hits, truth, as, max_cases);
  figures.unwritten = std::uint64_t(std::ranges::count_if(hits, untouched));
  const std::vector<RayStart> starts = batch.starts();
  for (std::size_t i = 0; i < starts.size(); ++i) {
    if (hits[i].prim != starts[i].hit.prim) continue;
    // A shadow ray to a light behind the surface crosses its own triangle: that self hit is correct.
    const std::optional<Triangle> own = triangle(hits[i].prim);
    const bool right = own && batch.name() == "shadow" && goes_behind(*own, starts[i].primary, truth.rays[i]);
    figures.self_hits += right ? 0 : 1;
  }
  return figures;
}

}  // namespace ballot
