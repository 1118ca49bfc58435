#include "engine/api/sums.h"

#include <algorithm>
#include <atomic>

namespace ballot::api {

namespace {

constexpr std::size_t kSome = 256;  // rays whose weights are read at a time

void add_to(std::int64_t& sum, std::int64_t more) { std::atomic_ref(sum).fetch_add(more, std::memory_order_relaxed); }

}  // namespace

std::size_t need_entries(const PlaceTable& table, SumsBy by, std::uint64_t room, const char* call) {
  const std::uint64_t entries = std::uint64_t{table.counts()[std::size_t(by)]} + 1;
  if (room < entries)
    refuse(fmt::format("{}: {} has {} entries; expected {}, of which the last is of rays that hit nothing", call,
                       kSums[std::size_t(by)], room, entries));
  return std::size_t(entries);
}

SumArrays::SumArrays(const BallotHits& to, const SceneState& scene, const RayArray& rays, const RowOrder& order,
                     std::uint32_t row)
    : table_(*scene.places), rays_(rays), order_(order), row_(row), to_{to.prim_sums, to.instance_sums, to.mesh_sums} {
  if (std::ranges::none_of(to_, [](const BallotSums& one) { return one.data != nullptr; })) {
    if (rays.weights()) refuse("rays: they have weights, but no sums are wanted; expected sums, or no weights");
    return;
  }
  unit_.emplace(rays.weights().largest(rays.count()), std::uint64_t{rays.count()} * row);
  for (std::size_t by = 0; by < kSumsBy; ++by)
    if (to_[by].data) sums_[by].resize(need_entries(table_, SumsBy(by), to_[by].count, "ballot_trace"));
}

/// Adds hits of rays that stand side by side, few of them.
void SumArrays::add_row(std::size_t place, std::span<const Hit> hits) {
  std::array<float, kSome> weights;
  const std::size_t first = place / row_, rays = (place + hits.size() - 1) / row_ - first + 1;
  rays_.weights().read(first, std::span(weights).first(rays));
  std::uint32_t near = 0;  // neighbours often hit one instance
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const std::uint32_t prim = hits[i].prim;
    if (prim == NO_HIT && (place + i) % row_) continue;
    const std::int64_t more = unit_->whole(weights[(place + i) / row_ - first]);
    if (prim != NO_HIT && (to_[1].data || to_[2].data)) near = table_.placement_of(prim, near);
    const std::array<std::uint32_t, kSumsBy> entries =
        prim == NO_HIT ? table_.counts() : std::array{prim, near, table_.mesh_of(near)};
    for (std::size_t by = 0; by < kSumsBy; ++by)
      if (to_[by].data) add_to(sums_[by][entries[by]], more);
  }
}

void SumArrays::add(std::size_t first, std::span<const Hit> hits) {
  if (!unit_) return;
  for_chunks(hits.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    order_.for_runs(first + begin, end - begin, [&](std::size_t i, std::size_t place, std::size_t n) {
      for (std::size_t k = 0; k < n; k += kSome - 1)
        add_row(place + k, hits.subspan(begin + i + k, std::min(kSome - 1, n - k)));
    });
  });
}

void SumArrays::end() const {
  for (std::size_t by = 0; by < kSumsBy; ++by)
    for_chunks(sums_[by].size(), kChunk, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) to_[by].data[i] = unit_->number(sums_[by][i]);
    });
}

}  // namespace ballot::api
