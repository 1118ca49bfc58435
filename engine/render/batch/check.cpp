#include "engine/render/batch/check.h"

#include <algorithm>
#include <chrono>
#include <cstring>

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

HitChecker::HitChecker(Tracer& tracer, Batches& batches)
    : batches_(batches),
      oracle_(tracer.pair_tree(NodeLayout::Interleaved)),
      exact_(tracer.pair_tree(NodeLayout::Interleaved)) {}

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
  return {oracle_.judge(truth.rays, hits, truth.hits, batch.want(), judged_as(find_numeric(query.numeric))),
          std::uint64_t(std::ranges::count_if(hits, untouched))};
}

ExactTruth HitChecker::exact_truth(const RayBatch& batch, const Progress& progress) const {
  ExactTruth truth{batch.rays(), {}, {}, 0};
  const ExactCounts before = exact_.counts();
  const auto start = std::chrono::steady_clock::now();
  truth.hits = exact_.nearest(truth.rays, progress);
  truth.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  truth.counts = exact_.counts() - before;
  return truth;
}

ErrorFigures HitChecker::judge(std::span<const Ray> rays, std::span<const Hit> answers, const ExactTruth& truth,
                               const Query& query, std::size_t max_cases) const {
  return error_figures(exact_, oracle_, rays, answers, truth.hits, query.want, find_numeric(query.numeric).arithmetic,
                       max_cases);
}

ErrorFigures HitChecker::verify(RayBatch& batch, const ExactTruth& truth, const Query& query,
                                std::size_t max_cases) const {
  const std::vector<Hit> hits = trace_over_pattern(batch, query);
  ErrorFigures figures = error_figures(exact_, oracle_, truth.rays, hits, truth.hits, batch.want(),
                                       find_numeric(query.numeric).arithmetic, max_cases);
  figures.unwritten = std::uint64_t(std::ranges::count_if(hits, untouched));
  const std::vector<RayStart> starts = batch.starts();
  for (std::size_t i = 0; i < starts.size(); ++i) {
    if (hits[i].prim != starts[i].hit.prim) continue;
    // A shadow ray to a light behind the surface crosses its own triangle: that self hit is correct.
    const std::optional<Triangle> own = exact_.triangle(hits[i].prim);
    const bool right = own && batch.name() == "shadow" && goes_behind(*own, starts[i].primary, truth.rays[i]);
    figures.self_hits += right ? 0 : 1;
  }
  return figures;
}

}  // namespace ballot
