#include "engine/render/check.h"

#include <algorithm>
#include <cstring>

namespace ballot {

namespace {

constexpr std::uint8_t kPattern =
    0xA5;  // no hit that a kernel writes looks like this: such a prim is beyond all scenes

bool untouched(const Hit& hit) {
  Hit pattern;
  std::memset(static_cast<void*>(&pattern), kPattern, sizeof pattern);
  return std::memcmp(&hit, &pattern, sizeof hit) == 0;
}

}  // namespace

HitChecker::HitChecker(Tracer& tracer, Batches& batches)
    : batches_(batches), oracle_(tracer.device_bvh(NodeLayout::Interleaved)) {}

Truth HitChecker::truth(const RayBatch& batch) const {
  Truth truth{batch.rays(), {}};
  truth.hits = oracle_.nearest(truth.rays);
  return truth;
}

HitCheck HitChecker::check(RayBatch& batch, const Truth& truth, const Query& query) const {
  batch.fill_hits(kPattern);
  batches_.trace(batch, query);
  const std::vector<Hit> hits = batch.hits();
  return {oracle_.judge(truth.rays, hits, truth.hits, batch.want(), find_numeric(query.numeric).arithmetic),
          std::uint64_t(std::ranges::count_if(hits, untouched))};
}

}  // namespace ballot
