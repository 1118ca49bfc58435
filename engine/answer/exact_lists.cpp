#include "engine/answer/exact_lists.h"

#include "engine/core/interruption.h"
#include "engine/core/parallel.h"
#include "engine/core/stopwatch.h"

namespace ballot {

namespace {

constexpr std::size_t kUnsureChunk = 1 << 10, kListedChunk = 1 << 4;

}  // namespace

/// Returns the ray whose first crossings are wanted (shaders/lib/query/first.glsl).
Ray ExactLists::walked(const Ray& ray) const {
  if (!query_.last) return ray;
  return {ray.origin, -ray.t_max, -ray.dir, -ray.t_min};
}

std::vector<Hit> ExactLists::hits_of(const std::vector<ExactCrossing>& crossings) const {
  std::vector<Hit> hits;
  hits.reserve(crossings.size());
  for (const ExactCrossing& c : crossings)
    hits.push_back({float(query_.last ? -c.t : c.t), c.prim, float(c.u), float(c.v)});
  return hits;
}

std::vector<ExactCrossing> ExactLists::find(const Ray& ray, const FilterWords& words, std::size_t i) const {
  return oracle_.list(walked(ray), [&](std::uint32_t prim, bool front) {
    if (query_.cull == (front != query_.last ? Cull::Front : Cull::Back)) return false;
    return judge_.keeps(words, i, prim);
  });
}

void ExactLists::count(std::span<const Ray> rays, const FilterWords& words, std::span<std::uint32_t> counts) const {
  const Stopwatch watch(tree_.walked_s());
  for_chunks(counts.size(), kUnsureChunk, [&](std::size_t begin, std::size_t end) {
    check_interruption();
    for (std::size_t i = begin; i < end; ++i) {
      if (counts[i] == UNSURE) counts[i] = std::uint32_t(find(rays[i], words, i).size());
    }
  });
}

std::vector<std::vector<Hit>> ExactLists::lists(const ListPart<Ray>& rays) const {
  std::vector<std::vector<Hit>> all(rays.size());
  const Stopwatch watch(tree_.walked_s());
  for_chunks(all.size(), kListedChunk, [&](std::size_t begin, std::size_t end) {
    check_interruption();
    for (std::size_t i = begin; i < end; ++i) all[i] = hits_of(find(rays.questions[i], rays.words, i));
  });
  return all;
}

void ExactLists::put_in_order(const Ray& ray, std::vector<Hit>& hits) const {
  std::vector<std::uint32_t> prims;
  prims.reserve(hits.size());
  for (const Hit& hit : hits) prims.push_back(hit.prim);
  hits = hits_of(oracle_.in_order(walked(ray), std::move(prims)));
}

}  // namespace ballot
