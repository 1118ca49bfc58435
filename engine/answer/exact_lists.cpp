#include "engine/answer/exact_lists.h"

#include "engine/core/interruption.h"
#include "engine/core/parallel.h"
#include "engine/core/stopwatch.h"

namespace ballot {

namespace {

constexpr std::size_t kUnsureChunk = 1 << 10, kListedChunk = 1 << 4;
constexpr std::uint32_t kAnyMask = 0xFFFFFFFFu;

std::vector<Hit> hits_of(const std::vector<ExactCrossing>& crossings) {
  std::vector<Hit> hits;
  hits.reserve(crossings.size());
  for (const ExactCrossing& c : crossings) hits.push_back({float(c.t), c.prim, float(c.u), float(c.v)});
  return hits;
}

}  // namespace

std::vector<ExactCrossing> ExactLists::find(const RaySpan& rays, std::size_t i) const {
  const Ray& ray = rays.rays[i];
  const std::uint32_t mask = rays.masks.empty() ? kAnyMask : rays.masks[i];
  if (query_.cull == Cull::None && query_.triangle_masks.empty()) {
    if (mask == 0) return {};
    return oracle_.list(ray);
  }
  return oracle_.list(ray, [&](std::uint32_t prim, bool front) {
    if (query_.cull == (front ? Cull::Front : Cull::Back)) return false;
    return ((query_.triangle_masks.empty() ? kAnyMask : query_.triangle_masks[prim]) & mask) != 0;
  });
}

void ExactLists::count(const RaySpan& rays, std::span<std::uint32_t> counts) const {
  const Stopwatch watch(tree_.walked_s());
  for_chunks(counts.size(), kUnsureChunk, [&](std::size_t begin, std::size_t end) {
    check_interruption();
    for (std::size_t i = begin; i < end; ++i) {
      if (counts[i] == UNSURE) counts[i] = std::uint32_t(find(rays, i).size());
    }
  });
}

std::vector<std::vector<Hit>> ExactLists::lists(const RaySpan& rays) const {
  std::vector<std::vector<Hit>> all(rays.rays.size());
  const Stopwatch watch(tree_.walked_s());
  for_chunks(all.size(), kListedChunk, [&](std::size_t begin, std::size_t end) {
    check_interruption();
    for (std::size_t i = begin; i < end; ++i) all[i] = hits_of(find(rays, i));
  });
  return all;
}

void ExactLists::put_in_order(const Ray& ray, std::vector<Hit>& hits) const {
  std::vector<std::uint32_t> prims;
  prims.reserve(hits.size());
  for (const Hit& hit : hits) prims.push_back(hit.prim);
  hits = hits_of(oracle_.in_order(ray, std::move(prims)));
}

}  // namespace ballot
