#include "engine/answer/crossing_kernels.h"

#include <algorithm>

#include "engine/core/error.h"
#include "engine/tree/formats/bvh8.h"

namespace ballot {

namespace {

constexpr std::uint32_t kAllBits = 0xFFFFFFFFu;

/// Returns the defines of a kernel. `alpha`: those of surfaces, if it reads them.
Defines defines_of(const CrossingVariant& v, bool wide, const Defines& alpha) {
  Defines defines{{"BALLOT_LISTS", v.lists}, {"BALLOT_FIRST", v.first > 0}, {"BALLOT_WIDE", wide},
                  {"BALLOT_EXACT", v.exact}, {"BALLOT_MASKS", v.masks},     {"BALLOT_CULL", int(v.cull)},
                  {"BALLOT_ALPHA", v.alpha}};
  if (v.alpha) defines.insert(defines.end(), alpha.begin(), alpha.end());
  return defines;
}

constexpr CrossingVariant kResults[] = {{}, {.lists = true}, {.lists = true, .first = 1}};

KernelSource sums_source() { return {.name = "query.places", .file = "query/places.comp", .group_size = PLACES_GROUP}; }

}  // namespace

std::vector<KernelSource> crossing_sources(const DeviceInfo& device, const TreeFacts& tree) {
  std::vector<KernelSource> sources{sums_source()};
  for (CrossingVariant v : kResults)
    for (const bool exact : {false, true})
      for (const bool masks : {false, true})
        for (const Cull cull : {Cull::None, Cull::Back, Cull::Front})
          for (const bool wide : {false, true}) {
            v.exact = exact, v.masks = masks, v.cull = cull;
            sources.push_back(query_source("crossings", device, tree, defines_of(v, wide, {}), wide));
          }
  return sources;
}

std::vector<KernelSource> alpha_crossing_sources(const DeviceInfo& device, const TreeFacts& tree,
                                                 const Defines& alpha) {
  std::vector<KernelSource> sources;
  for (CrossingVariant v : kResults)
    for (const bool wide : {false, true}) {
      v.alpha = true;
      sources.push_back(query_source("crossings", device, tree, defines_of(v, wide, alpha), wide));
    }
  return sources;
}

void CrossingKernels::prepare(bool masks, std::span<const std::uint32_t> triangle_masks) {
  if (whole_.update()) kernels_.clear();
  if (!masks) return;
  const Forest* forest = tree().forest();
  const std::size_t triangles = forest ? std::size_t(forest->triangle_count()) : tree().bvh().stats.triangles;
  if (triangle_masks.empty()) {
    all_bits_.assign(triangles, kAllBits);
    triangle_masks = all_bits_;
  }
  if (triangle_masks.size() != triangles)
    fail(Failure::Arguments, "masks of triangles: found {}; the scene has {} triangles", triangle_masks.size(),
         triangles);
  if (triangle_masks_ && std::ranges::equal(triangle_masks, uploaded_)) return;
  uploaded_.assign(triangle_masks.begin(), triangle_masks.end());
  buffer_for(triangle_masks_, gpu_, triangles, "masks of triangles").upload(triangle_masks);
}

QueryKernel& CrossingKernels::kernel(const CrossingVariant& variant, bool pairs) {
  Kernels& all = kernels_[variant];
  // CPU devices walk the eight-wide tree, of which fewer nodes have to be read, if it can number as many. They walk
  // pairs where it would have to be made anew for each frame.
  const bool wide =
      !pairs && gpu_.info().is_cpu() && !tree().has_moved() && tree().bvh().stats.leaves <= kBvh8MostNodes;
  std::optional<QueryKernel>& one = pairs ? all.pieces : all.whole;
  if (!one || one->is_wide() != wide)
    one.emplace(gpu_, tree(), "crossings", defines_of(variant, wide, alpha_.defines), wide,
                variant.first ? SpecConstants{{SPEC_FIRST, variant.first}} : SpecConstants{});
  one->prepare();
  return *one;
}

std::uint32_t CrossingKernels::most(const CrossingVariant& variant) { return kernel(variant, false).most(); }

std::vector<TreePiece> CrossingKernels::pieces(const CrossingVariant& variant, std::uint64_t limit) {
  return kernel(variant, true).pieces(limit);
}

/// `are_there`: the last call has brought these rays to the device.
void CrossingKernels::bind_rays(QueryKernel& kernel, const CrossingVariant& variant, const RaySpan& some,
                                bool are_there) {
  Buffer<Ray>& buffer = buffer_for(rays_, gpu_, some.rays.size(), "rays of a query");
  if (!are_there) buffer.upload(some.rays);
  kernel.bind(BIND_RAYS, buffer);
  bind_masks(kernel, variant, some.rays.size(), some.masks);
}

/// Binds what filters crossings.
void CrossingKernels::bind_masks(QueryKernel& kernel, const CrossingVariant& variant, std::size_t rays,
                                 std::span<const std::uint32_t> masks) {
  if (variant.alpha) kernel.bind(alpha_);
  if (!variant.masks) return;
  Buffer<std::uint32_t>& buffer = buffer_for(ray_masks_, gpu_, rays, "masks of rays");
  if (masks.empty()) all_bits_.assign(rays, kAllBits);
  buffer.upload(masks.empty() ? std::span<const std::uint32_t>(all_bits_) : masks);
  kernel.bind(BIND_RAY_MASKS, buffer);
  kernel.bind(BIND_TRIANGLE_MASKS, *triangle_masks_);
}

std::uint32_t CrossingKernels::count_there(const CrossingVariant& variant, const Chunk<Ray, std::uint32_t>& chunk,
                                           std::span<const std::uint32_t> masks, TraceTimes& times) {
  QueryKernel& counts = kernel(variant, false);
  counts.bind(BIND_RAYS, chunk.questions);
  counts.bind(BIND_CROSSINGS, chunk.answers);
  bind_masks(counts, variant, chunk.here.size(), masks);
  const TreePiece whole{tree().root()};
  if (!counts.can_record(chunk.count())) return counts.run(0, chunk.count(), whole, times, chunk.launched);
  counts.record(0, chunk.count(), whole, times);
  return 0;
}

std::uint32_t CrossingKernels::run(QueryKernel& kernel, Below piece, const CrossingVariant& variant,
                                   const RaySpan& some, std::span<std::uint32_t> found, TraceTimes& times,
                                   bool are_there) {
  bind_rays(kernel, variant, some, are_there);
  kernel.bind(BIND_CROSSINGS, buffer_for(counts_, gpu_, some.rays.size(), "numbers of crossings"));
  const std::uint32_t unfinished =
      kernel.run(std::uint32_t(some.rays.size()), piece.value_or(TreePiece{tree().root()}), times);
  counts_->download(found);
  return unfinished;
}

std::uint32_t CrossingKernels::count(const CrossingVariant& variant, const RaySpan& some,
                                     std::span<std::uint32_t> found, TraceTimes& times, Below piece) {
  return run(kernel(variant, piece.has_value()), piece, variant, some, found, times);
}

std::uint32_t CrossingKernels::list_to(Slots& to, std::uint32_t slots, const CrossingVariant& variant,
                                       const RaySpan& some, std::span<std::uint32_t> found, TraceTimes& times,
                                       Below piece, bool are_there) {
  QueryKernel& lists = kernel(variant, piece.has_value());
  lists.bind(BIND_PLACES, *places_);
  lists.bind(BIND_HITS, buffer_for(to.buffer, gpu_, slots, "crossings"));
  const std::uint32_t unfinished = run(lists, piece, variant, some, found, times, are_there);
  fetch(to, slots);
  return unfinished;
}

/// The host reads the slots where they lie on a CPU device, else a copy.
void CrossingKernels::fetch(Slots& from, std::uint32_t slots) {
  if (gpu_.info().is_cpu() && from.buffer->mapped()) {
    hits_ = {reinterpret_cast<const Hit*>(from.buffer->mapped()), slots};
    return;
  }
  from.fetched.resize(slots);
  if (slots) from.buffer->download(std::span(from.fetched));
  hits_ = from.fetched;
}

std::uint32_t CrossingKernels::list(const CrossingVariant& variant, const RaySpan& some,
                                    std::span<const std::uint32_t> to, std::span<std::uint32_t> found,
                                    TraceTimes& times) {
  buffer_for(places_, gpu_, to.size(), "places of crossings").upload(to);
  return list_to(slots_, to.back(), variant, some, found, times);
}

std::uint32_t CrossingKernels::list_apart(const CrossingVariant& variant, const RaySpan& some,
                                          std::span<const std::uint32_t> to, std::span<std::uint32_t> found,
                                          TraceTimes& times, Below piece) {
  buffer_for(places_, gpu_, to.size(), "places of crossings").upload(to);
  return list_to(apart_, to.back(), variant, some, found, times, piece);
}

/// Writes to places_ how many crossings the rays before each have.
void CrossingKernels::sum_counts(std::uint32_t count, TraceTimes& times) {
  refresh(gpu_, sums_, sums_source());
  // A place behind the last ray has the sum of all.
  const std::uint32_t tiles = count / PLACES_TILE + 1;
  sums_->bind(BIND_CROSSINGS, *counts_);
  sums_->bind(BIND_PLACES, buffer_for(places_, gpu_, count + 1, "places of crossings"));
  sums_->bind(BIND_TILES, buffer_for(tiles_, gpu_, tiles, "sums of crossings"));
  for (const std::uint32_t step : {PLACES_TILES, PLACES_SUM, PLACES_PLACE}) {
    const PlacesPush push{count, tiles, step};
    gpu_.submit(sums_->name(), [&](Commands& cmd) { sums_->dispatch(cmd, step == PLACES_SUM ? 1 : tiles, push); });
    times.device_ms += gpu_.last_ms();
    ++times.dispatches;
  }
}

bool CrossingKernels::count_and_list(const CrossingVariant& variant, const RaySpan& some, std::uint32_t most,
                                     std::span<std::uint32_t> room, std::span<std::uint32_t> found, TraceTimes& times) {
  CrossingVariant counting = variant;
  counting.lists = false;
  count(counting, some, room, times);
  std::uint64_t all = 0;
  for (std::uint32_t& n : room) all += n = n < UNSURE ? n : 0;
  if (all > most) return false;
  sum_counts(std::uint32_t(some.rays.size()), times);
  list_to(slots_, std::uint32_t(all), variant, some, found, times, {}, true);
  return true;
}

}  // namespace ballot
