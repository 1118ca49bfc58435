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

}  // namespace

HitChecker::HitChecker(Tracer& tracer, Batches& batches) : batches_(batches) {
  if (const Forest* forest = tracer.tree().forest()) {
    forest_oracle_.emplace(*forest);
    forest_exact_.emplace(*forest);
  } else {
    oracle_.emplace(tracer.pair_tree(NodeLayout::Interleaved));
    exact_.emplace(tracer.pair_tree(NodeLayout::Interleaved), tracer.tree().triangles());
  }
}

ExactCounts HitChecker::counts() const { return forest_exact_ ? forest_exact_->counts() : exact_->counts(); }

std::optional<Triangle> HitChecker::triangle(std::uint32_t prim) const {
  if (!forest_exact_) return exact_->triangle(prim);
  const Forest& forest = forest_exact_->forest();
  return forest.triangle(forest.place_of(prim));
}

Truth HitChecker::truth(const RayBatch& batch) const {
  Truth truth{batch.rays(), {}};
  truth.hits = forest_oracle_ ? forest_oracle_->nearest(truth.rays) : oracle_->nearest(truth.rays);
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
  return {forest_oracle_ ? forest_oracle_->judge(truth.rays, hits, batch.want(), as)
                         : oracle_->judge(truth.rays, hits, truth.hits, batch.want(), as),
          std::uint64_t(std::ranges::count_if(hits, untouched))};
}

ExactTruth HitChecker::exact_truth(const RayBatch& batch, const Progress& progress) const {
  ExactTruth truth{batch.rays(), {}, {}, 0};
  const ExactCounts before = counts();
  const Timer timer;
  truth.hits = forest_exact_ ? forest_exact_->nearest(truth.rays, progress) : exact_->nearest(truth.rays, progress);
  truth.seconds = timer.seconds();
  truth.counts = counts() - before;
  return truth;
}

ErrorFigures HitChecker::judge(std::span<const Ray> rays, std::span<const Hit> answers, const ExactTruth& truth,
                               const Query& query, std::size_t max_cases) const {
  const Arithmetic as = find_numeric(query.numeric).arithmetic;
  if (forest_exact_)
    return error_figures(*forest_exact_, *forest_oracle_, rays, answers, truth.hits, query.want, as, max_cases);
  return error_figures(*exact_, *oracle_, rays, answers, truth.hits, query.want, as, max_cases);
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
