#include "engine/answer/query_filters.h"

#include <algorithm>

#include "engine/core/error.h"
#include "engine/core/parallel.h"

namespace ballot {

namespace {
constexpr std::uint32_t kAllBits = 0xFFFFFFFFu;
static_assert(kSharedGroup == GROUP_SHARED);
}  // namespace

std::uint32_t QueryFilters::take(DeviceTree& tree, std::uint32_t filters,
                                 std::span<const std::uint32_t> triangle_masks) {
  filters_ = filters | (triangle_masks.empty() ? 0u : 1u << FILTER_MASK);
  if (!tree.forest() || !tree.forest()->has_groups()) filters_ &= ~(1u << FILTER_GROUP);
  if (has(FILTER_MASK)) take_masks(tree, triangle_masks);
  if (has(FILTER_GROUP)) take_groups(tree);
  return filters_;
}

void QueryFilters::take_masks(const DeviceTree& tree, std::span<const std::uint32_t> triangle_masks) {
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

void QueryFilters::take_groups(const DeviceTree& tree) {
  if (groups_ && generation_ == tree.generation()) return;
  std::vector<TopGroup> groups = tree.forest()->top().groups;
  std::uint32_t shared = END_OF_TREE;
  if (!groups.empty() && groups.back().group == GROUP_SHARED) shared = groups.back().root, groups.pop_back();
  std::vector<std::uint32_t> words{std::uint32_t(groups.size()), shared};
  for (const TopGroup& g : groups) words.push_back(g.group);
  for (const TopGroup& g : groups) words.push_back(g.root);
  gpu_.finish();  // passes that read those of before
  buffer_for(groups_, gpu_, words.size(), "groups of instances").upload(words);
  generation_ = tree.generation();
}

void QueryFilters::bind_scene(QueryKernel& kernel) {
  if (has(FILTER_MASK)) kernel.bind(BIND_TRIANGLE_MASKS, *triangle_masks_);
  if (has(FILTER_GROUP)) kernel.bind(BIND_GROUPS, *groups_);
}

void QueryFilters::bind(QueryKernel& kernel, std::size_t questions, const FilterWords& words, bool apart) {
  for (std::uint32_t f = 0; f < FILTERS; ++f) {
    if (!has(f)) continue;
    std::span<const std::uint32_t> mine = words.of[f];
    if (mine.empty()) {
      all_bits_.assign(std::max(all_bits_.size(), questions), kAllBits);
      mine = std::span<const std::uint32_t>(all_bits_).first(questions);
    }
    bind_words(kernel, f, mine, apart);
  }
}

void QueryFilters::bind_words(QueryKernel& kernel, std::uint32_t filter, std::span<const std::uint32_t> words,
                              bool apart) {
  Words& all = words_[filter];
  Room& next = all.rooms[all.turn % all.rooms.size()];
  Buffer<std::uint32_t>& there = buffer_for(apart ? all.apart : next.there, gpu_, words.size(), "words of questions");
  all.last.emplace(there);
  kernel.bind(BIND_QUESTION_WORDS + filter, there);
  if (apart || there.mapped()) return there.upload(words);
  ++all.turn;
  if (!next.here || next.here->size() < words.size()) {
    next.here.reset();
    next.here = std::make_unique<Buffer<std::uint32_t>>(gpu_, words.size(), Access::Host, "words of the host");
  }
  copy_parallel(words, std::span(reinterpret_cast<std::uint32_t*>(next.here->mapped()), words.size()));
  gpu_.pass("copying words of questions in",
            [&](Commands& cmd) { cmd.copy(*next.here, there, words.size() * sizeof(std::uint32_t)); });
}

void QueryFilters::bind_there(QueryKernel& kernel, const DeviceFilters& words, std::uint64_t first, std::size_t count) {
  for (std::uint32_t f = 0; f < FILTERS; ++f) {
    if (!has(f)) continue;
    const Buffer<std::uint32_t>* const mine = words.of[f];
    if (!mine && make_room(no_masks_, gpu_, count, "masks of all bits"))
      gpu_.pass("all bits of masks", [&](Commands& cmd) { cmd.fill(*no_masks_, kAllBits); });
    const BufferPart all = mine ? BufferPart(*mine, first * sizeof kAllBits, count * sizeof kAllBits) : *no_masks_;
    kernel.bind(BIND_QUESTION_WORDS + f, words_[f].last.emplace(all));
  }
}

void QueryFilters::bind_again(QueryKernel& kernel) {
  for (std::uint32_t f = 0; f < FILTERS; ++f)
    if (has(f)) kernel.bind(BIND_QUESTION_WORDS + f, *words_[f].last);
}

}  // namespace ballot
