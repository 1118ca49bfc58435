#include "engine/tree/device/joined_array.h"

#include <algorithm>

#include "engine/core/error.h"

namespace ballot {

namespace {

constexpr std::uint64_t kMostTexels = 1ull << 31;  // a texel's index keeps the top bit clear
constexpr std::size_t kAlignment = 16;             // texels: a region can be bound by itself

std::size_t aligned(std::size_t texels) {
  return std::max((texels + kAlignment - 1) / kAlignment, std::size_t{1}) * kAlignment;
}

}  // namespace

bool JoinedArray::fits(std::size_t meshes, std::span<const Wanted> wanted) const {
  if (!texels_ || regions_.size() != meshes) return false;
  // A single mesh has a buffer of its size, or of up to twice that once it has shrunk.
  return std::ranges::all_of(wanted, [&](const Wanted& w) {
    const std::size_t room = regions_[w.mesh].room;
    return w.texels <= room && (meshes > 1 || w.texels >= room / 2);
  });
}

void JoinedArray::make_room(std::size_t meshes, std::span<const Wanted> wanted) {
  for (const Wanted& w : wanted)
    if (w.mesh < regions_.size()) regions_[w.mesh].revision = 0;
  if (fits(meshes, wanted)) return;
  std::vector<Region> to(meshes);
  for (std::size_t i = 0; i < std::min(meshes, regions_.size()); ++i) to[i] = regions_[i];
  for (const Wanted& w : wanted) {
    const bool grows = to[w.mesh].room > 0;  // and may do so again
    to[w.mesh] = {0, meshes == 1 ? w.texels : aligned(w.texels + (grows ? w.texels / 4 : 0)), 0};
  }
  std::size_t all = 0;
  std::vector<RawBuffer::Part> kept;
  for (std::size_t i = 0; i < meshes; ++i) {
    if (to[i].revision) kept.push_back({to[i].first * 16, all * 16, to[i].room * 16});
    to[i].first = all;
    all += to[i].room;
    if (all > kMostTexels)
      fail(Failure::Work, "{} of meshes 0 to {}: {} bytes; at most {} can be addressed; use fewer or smaller meshes",
           name_, i, all * sizeof(glm::uvec4), kMostTexels * sizeof(glm::uvec4));
  }
  if (kept.empty()) texels_.reset(), regions_.clear();  // before the new memory; else they stay if there is no room
  const bool in_parts = meshes > 1 && has(access_, Access::Address);
  Texels made(gpu_, all, in_parts ? access_ | Access::Parts : access_, name_);
  if (!kept.empty()) made.copy_parts(*texels_, kept);
  gpu_.finish();
  texels_ = std::move(made);
  regions_ = std::move(to);
}

void JoinedArray::renumber(std::span<const std::optional<std::uint32_t>> from) {
  std::vector<Region> to(from.size());
  for (std::size_t i = 0; i < to.size(); ++i)
    if (from[i] && *from[i] < regions_.size()) to[i] = regions_[*from[i]];
  if (to.size() == 1 && regions_.size() > 1) to[0] = {};  // a single mesh has the whole buffer
  regions_ = std::move(to);
}

BufferPart JoinedArray::part(std::size_t mesh) const {
  if (regions_.size() == 1) return *texels_;
  const Region& r = regions_[mesh];
  return {*texels_, r.first * sizeof(glm::uvec4), r.room * sizeof(glm::uvec4)};
}

}  // namespace ballot
