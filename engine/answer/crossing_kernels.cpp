#include "engine/answer/crossing_kernels.h"

#include "engine/tree/formats/bvh8.h"

namespace ballot {

namespace {

/// Returns the defines of a kernel. `alpha`: those of surfaces, if it reads them.
Defines defines_of(const CrossingVariant& v, bool wide, const Defines& alpha) {
  Defines defines{{"BALLOT_LISTS", int(v.lists)}, {"BALLOT_FIRST", v.first > 0}, {"BALLOT_ANY", v.any},
                  {"BALLOT_LAST", v.last},        {"BALLOT_WIDE", wide},         {"BALLOT_EXACT", v.exact},
                  {"BALLOT_CULL", int(v.cull)},   {"BALLOT_ALPHA", v.alpha},     {"BALLOT_FILTERS", int(v.filters)}};
  if (v.alpha) defines.insert(defines.end(), alpha.begin(), alpha.end());
  return defines;
}

constexpr CrossingVariant kResults[] = {{},
                                        {.lists = LISTS_ROWS},
                                        {.lists = LISTS_PLACES},
                                        {.lists = LISTS_ROWS, .first = 1},
                                        {.lists = LISTS_ROWS, .first = 1, .last = true},
                                        {.lists = LISTS_ROWS, .any = true, .first = 1},
                                        {.lists = LISTS_PLACES, .first = 1},
                                        {.lists = LISTS_PLACES, .first = 1, .last = true}};

// Filters of registered kernels. Others are compiled likewise.
constexpr std::uint32_t kFilters[] = {0, 1u << FILTER_MASK, 1u << FILTER_EXCLUDED | 1u << FILTER_GROUP};

/// Returns true if a kernel for this result is used. Mode exact alone lists first crossings that fit into no row, and
/// does not end a walk early.
bool is_used(const CrossingVariant& v) { return v.first == 0 || (v.exact ? !v.any : v.lists == LISTS_ROWS); }

}  // namespace

std::vector<KernelSource> crossing_sources(const DeviceInfo& device, const TreeFacts& tree) {
  std::vector<KernelSource> sources;
  for (CrossingVariant v : kResults)
    for (const bool exact : {false, true})
      for (const std::uint32_t filters : kFilters)
        for (const Cull cull : {Cull::None, Cull::Back, Cull::Front})
          for (const bool wide : {false, true}) {
            v.exact = exact, v.filters = filters, v.cull = cull;
            if (is_used(v)) sources.push_back(query_source("crossings", device, tree, defines_of(v, wide, {}), wide));
          }
  return sources;
}

std::vector<KernelSource> alpha_crossing_sources(const DeviceInfo& device, const TreeFacts& tree,
                                                 const Defines& alpha) {
  std::vector<KernelSource> sources;
  for (CrossingVariant v : kResults)
    for (const bool wide : {false, true}) {
      v.alpha = true;
      if (is_used(v)) sources.push_back(query_source("crossings", device, tree, defines_of(v, wide, alpha), wide));
    }
  return sources;
}

std::uint32_t CrossingKernels::prepare(std::uint32_t filters, std::span<const std::uint32_t> triangle_masks) {
  if (whole_.update()) kernels_.clear();
  return filters_.take(tree(), filters, triangle_masks);
}

QueryKernel& CrossingKernels::kernel(const CrossingVariant& variant, bool pairs) {
  Kernels& all = kernels_[variant];
  // CPU devices walk the eight-wide tree, of which fewer nodes have to be read, if it can number as many. They walk
  // pairs where it would have to be made anew for each frame.
  const bool wide =
      !pairs && gpu_.info().is_cpu() && !tree().has_moved() && tree().bvh().stats.leaves <= kBvh8MostNodes;
  std::optional<QueryKernel>& one = pairs ? all.pieces : all.whole;
  if (!one || one->is_wide() != wide) {
    SpecConstants constants;
    if (variant.first) constants[SPEC_FIRST] = variant.first;
    if (variant.lists != LISTS_NONE) constants[SPEC_ROW] = variant.row;
    one.emplace(gpu_, tree(), "crossings", defines_of(variant, wide, alpha_.defines), wide, std::move(constants));
  }
  one->prepare();
  if (variant.alpha) one->bind(alpha_);
  if (variant.filters) filters_.bind_scene(*one);
  return *one;
}

std::vector<TreePiece> CrossingKernels::pieces(const CrossingVariant& variant, std::uint64_t limit) {
  return kernel(variant, true).pieces(limit);
}

std::uint32_t CrossingKernels::count_there(const CrossingVariant& variant, const Chunk<Ray, std::uint32_t>& chunk,
                                           const FilterWords& words, TraceTimes& times) {
  QueryKernel& counts = kernel(variant, false);
  counts.bind(BIND_RAYS, chunk.questions);
  counts.bind(BIND_CROSSINGS, chunk.answers);
  filters_.bind(counts, chunk.here.size(), words, false);
  return counts.answer(0, chunk.count(), {tree().root()}, times, chunk.launched);
}

std::uint32_t CrossingKernels::count(const CrossingVariant& variant, const ListPart<Ray>& some,
                                     std::span<std::uint32_t> found, TraceTimes& times, const TreePiece& piece) {
  QueryKernel& counts = kernel(variant, true);
  Buffer<Ray>& rays = buffer_for(rays_, gpu_, some.size(), "rays of a query");
  rays.upload(some.questions);
  counts.bind(BIND_RAYS, rays);
  counts.bind(BIND_CROSSINGS, buffer_for(counts_, gpu_, some.size(), "numbers of crossings"));
  filters_.bind(counts, some.size(), some.words, true);
  const std::uint32_t unfinished = counts.run(std::uint32_t(some.size()), piece, times);
  counts_->download(found);
  return unfinished;
}

}  // namespace ballot
