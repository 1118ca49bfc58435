#include "engine/answer/point_order.h"

#include <algorithm>
#include <bit>
#include <limits>

#include "engine/answer/reorder.h"

namespace ballot {

namespace {

constexpr std::uint32_t kFewSorted = 1 << 13;  // fewer points are not sorted: that takes a dozen dispatches
constexpr std::uint32_t kSamples = 256;        // tiles

KernelSource neighbour_source() {
  return {.name = "query.neighbours", .file = "query/neighbours.comp", .group_size = NEIGHBOURS_GROUP};
}

}  // namespace

std::vector<KernelSource> neighbour_sources() { return {neighbour_source()}; }

void PointOrder::make_room(std::uint32_t count) {
  if (count <= most_) return;
  const std::uint32_t room = std::bit_ceil(std::max(count, NEIGHBOURS_TILE));
  most_ = 0;  // there is no room if the device has too little memory for one of these
  const bool sorts = room > kFewSorted && can_reorder(gpu_.info());
  near_.emplace(gpu_, room, Access::Storage, "points in order of tiles");
  for (auto& keys : keys_) keys.emplace(gpu_, sorts ? room : 1, Access::Storage, "keys of points");
  for (auto& order : order_) order.emplace(gpu_, sorts ? room : 1, Access::Storage, "order of points");
  if (sorts) sort_ = std::make_unique<RadixSort>(gpu_, NEIGHBOURS_KEY_BITS, room, true);
  most_ = room;
}

void PointOrder::record(const RawBuffer& points, std::uint32_t first, std::uint32_t count, const Bounds& scene,
                        const Context::Done& done) {
  make_room(count);
  if (!state_) {
    state_.emplace(gpu_, 1, Access::Storage, "what is known of an order of points");
    args_.emplace(gpu_, 1, Access::Storage, "number of points to sort");
  }
  if (refresh(gpu_, kernel_, neighbour_source())) gpu_.save_pipeline_cache();
  constexpr int kMost = std::numeric_limits<int>::max();
  state_->record_upload(std::vector{NeighbourState{first, 0, {kMost, kMost, kMost}, {-kMost, -kMost, -kMost}}});
  args_->record_upload(std::vector{IndirectArgs{}});
  const glm::vec3 sides = scene.hi - scene.lo;
  const bool sorts = sort_ && count >= kFewSorted;
  const std::uint32_t samples = std::min(count / NEIGHBOURS_TILE, kSamples);
  NeighboursPush push{NEIGHBOURS_TILES, first, count, samples, std::max({sides.x, sides.y, sides.z, 1e-30f})};
  kernel_->bind(BIND_RAYS, points);
  kernel_->bind(BIND_NEIGHBOUR_STATE, *state_);
  kernel_->bind(BIND_SORTED, *args_);
  kernel_->bind(BIND_ORDER_NEAR, *near_);
  kernel_->bind(BIND_NEIGHBOUR_KEYS, *keys_[0]);
  const auto pass = [&](std::uint32_t step, std::uint32_t groups) {
    push.step = step;
    gpu_.pass(
        kernel_->name(), [&](Commands& cmd) { kernel_->dispatch(cmd, groups, push); }, done);
  };
  if (sorts) pass(NEIGHBOURS_SAMPLE, samples), pass(NEIGHBOURS_DECIDE, 1);
  pass(NEIGHBOURS_TILES, groups_of(count, NEIGHBOURS_TILE));
  sorted_ = 0;
  if (!sorts) return;
  pass(NEIGHBOURS_KEYS, groups_of(count, NEIGHBOURS_TILE));
  sorted_ = sort_->record({{&*keys_[0], &*keys_[1]}, {&*order_[0], &*order_[1]}},
                          {.most = count, .args = &*args_, .index = 0}, done);
}

}  // namespace ballot
