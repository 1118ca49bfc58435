#include "engine/answer/query_masks.h"

#include <algorithm>

#include "engine/core/error.h"
#include "engine/core/parallel.h"

namespace ballot {

namespace {
constexpr std::uint32_t kAllBits = 0xFFFFFFFFu;
}  // namespace

void QueryMasks::take(DeviceTree& tree, std::span<const std::uint32_t> triangle_masks) {
  const Forest* forest = tree.forest();
  const std::size_t triangles = forest ? std::size_t(forest->triangle_count()) : tree.bvh().stats.triangles;
  if (triangle_masks.empty()) {
    all_bits_.assign(std::max(all_bits_.size(), triangles), kAllBits);
    triangle_masks = std::span<const std::uint32_t>(all_bits_).first(triangles);
  }
  if (triangle_masks.size() != triangles)
    fail(Failure::Arguments, "masks of triangles: found {}; the scene has {} triangles", triangle_masks.size(),
         triangles);
  if (triangle_masks_ && std::ranges::equal(triangle_masks, uploaded_)) return;
  uploaded_.assign(triangle_masks.begin(), triangle_masks.end());
  buffer_for(triangle_masks_, gpu_, triangles, "masks of triangles").upload(triangle_masks);
}

void QueryMasks::bind(QueryKernel& kernel, std::size_t questions, std::span<const std::uint32_t> masks, bool apart) {
  if (masks.empty()) all_bits_.assign(std::max(all_bits_.size(), questions), kAllBits);
  if (masks.empty()) masks = std::span<const std::uint32_t>(all_bits_).first(questions);
  Room& next = rooms_[turn_ % rooms_.size()];
  Buffer<std::uint32_t>& there = buffer_for(apart ? apart_ : next.there, gpu_, questions, "masks of questions");
  last_.emplace(there);
  kernel.bind(BIND_RAY_MASKS, there);
  if (apart || there.mapped()) return there.upload(masks);
  ++turn_;
  if (!next.here || next.here->size() < questions) {
    next.here.reset();
    next.here = std::make_unique<Buffer<std::uint32_t>>(gpu_, questions, Access::Host, "masks of the host");
  }
  copy_parallel(masks, std::span(reinterpret_cast<std::uint32_t*>(next.here->mapped()), questions));
  gpu_.pass("copying masks in", [&](Commands& cmd) { cmd.copy(*next.here, there, questions * sizeof(std::uint32_t)); });
}

void QueryMasks::bind_there(QueryKernel& kernel, const Buffer<std::uint32_t>* masks, std::uint64_t first,
                            std::size_t count) {
  if (!masks && make_room(no_masks_, gpu_, count, "masks of all bits"))
    gpu_.pass("all bits of masks", [&](Commands& cmd) { cmd.fill(*no_masks_, kAllBits); });
  const BufferPart all = masks ? BufferPart(*masks, first * sizeof kAllBits, count * sizeof kAllBits) : *no_masks_;
  kernel.bind(BIND_RAY_MASKS, last_.emplace(all));
}

}  // namespace ballot
