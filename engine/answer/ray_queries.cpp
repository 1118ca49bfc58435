#include "engine/answer/ray_queries.h"

#include "engine/answer/ray_parts.h"
#include "engine/core/error.h"
#include "engine/core/parallel.h"

namespace ballot {

using namespace ray_queries;

void RayQueries::Parts::begin(const RaySource& source, const CrossingQuery& wanted, bool lists) {
  if (wanted.alpha && wanted.exact)
    fail(Failure::Arguments,
         "crossings: found alpha and mode exact; expected one of them: textures are read in float32");
  query = wanted;
  variant = {.lists = lists,
             .exact = query.exact,
             .masks = source.masks || !query.triangle_masks.empty(),
             .alpha = query.alpha && kernels.has_alpha(),
             .cull = query.cull};
  if (lists && query.most <= kMostFirst) variant.first = query.most;
  room = std::max(kFirstSlots, variant.first + kFirstSlots / 2);
  by_counts = lists && !variant.first && counts_first.value_or(!gpu.info().is_cpu());
  kernels.prepare(variant.masks, query.triangle_masks);
  exact_lists.reset();
  if (query.exact) exact_lists.emplace(kernels.tree(), query);
}

/// Reads rays and puts them into an order. On a CPU device that is one in which neighbours are alike.
void RayQueries::Parts::read(const RaySource& source, std::uint64_t first, std::size_t count) {
  given.resize(count, bool(source.masks));
  source.read(first, given.rays);
  if (source.masks) source.masks(first, given.masks);
  const bool sorts = gpu.info().is_cpu() && !by_counts && count >= kFewRays;
  if (!sorts || !order_rays(given.rays, kernels.tree().bvh().bounds, order)) {
    order.clear();
    std::swap(given, asked);
    return;
  }
  asked.resize(count, bool(source.masks));
  for_chunks(count, kRayChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) asked.take(given, order[i], i);
  });
}

/// Lists the crossings of one ray whose walk the driver cut short.
std::vector<Hit> RayQueries::Parts::list_in_pieces(const RaySpan& ray, TraceTimes& times) {
  CrossingVariant counting = variant, listing = variant;
  counting.lists = false;
  counting.first = listing.first = 0;
  ListWalk walk{kernels, counting, listing, ray, times};
  ListWalk::Answer answer{UNFINISHED};
  repair(walk, std::span(&answer, 1), kFirstPieces, gpu, times);
  return answer.number == UNSURE ? exact_lists->lists(ray)[0] : std::move(answer.hits);
}

/// Has a little room for each ray; those that need more are listed again.
void RayQueries::Parts::list_with_room(Answers& answers, TraceTimes& times) {
  const std::size_t count = asked.rays.size();
  std::vector<std::uint32_t> to(count + 1);
  for (std::uint32_t i = 0; i <= count; ++i) to[i] = i * room;
  found.resize(count);
  kernels.list(variant, asked.span(0, count), to, found, times);
  Lists lists;
  lists.slots = kernels.hits();
  lists.places.resize(count);
  for (std::uint32_t i = 0; i < count; ++i) lists.places[i] = {to[i], std::min(found[i], room)};
  list_open(0, lists, times);
  collect(0, lists, answers);
}

/// Counts first, and so takes no more room than there are crossings. Does so in halves if that is too much.
void RayQueries::Parts::list_by_counts(std::size_t begin, std::size_t count, Answers& answers, TraceTimes& times) {
  found.resize(count);
  const std::uint32_t most = count == 1 ? UNSURE - 1 : kMostSlots;
  std::vector<std::uint32_t> room_of(count);
  if (!kernels.count_and_list(variant, asked.span(begin, count), most, room_of, found, times)) {
    list_by_counts(begin, count / 2, answers, times);
    list_by_counts(begin + count / 2, count - count / 2, answers, times);
    return;
  }
  Lists lists;
  lists.slots = kernels.hits();
  lists.places.resize(count);
  std::uint32_t sum = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    lists.places[i] = {sum, found[i] < UNSURE ? room_of[i] : 0};
    sum += room_of[i];
  }
  list_open(begin, lists, times);
  collect(begin, lists, answers);
}

/// Lists the rays whose crossings did not fit, were cut short or are unsure, apart.
void RayQueries::Parts::list_open(std::size_t begin, Lists& lists, TraceTimes& times) {
  const auto apart = [&](std::size_t i, std::vector<Hit> hits) {
    lists.places[i] = {0, std::uint32_t(hits.size()), std::uint32_t(lists.apart.size() + 1)};
    lists.apart.push_back(std::move(hits));
  };
  std::vector<std::uint32_t> more, unsure;  // more: rays that need more room
  RayPart unsure_rays;
  for (std::uint32_t i = 0; i < found.size(); ++i) {
    if (found[i] == UNFINISHED)
      apart(i, list_in_pieces(asked.span(begin + i, 1), times));
    else if (found[i] == UNSURE)
      unsure.push_back(i), unsure_rays.add(asked, begin + i);
    else if (found[i] > lists.places[i].count)
      more.push_back(i);
  }
  if (!unsure.empty()) {
    std::vector<std::vector<Hit>> listed = exact_lists->lists(unsure_rays.span(0, unsure.size()));
    for (std::size_t k = 0; k < unsure.size(); ++k) apart(unsure[k], std::move(listed[k]));
  }
  for (std::size_t first = 0; first < more.size();) {
    RayPart part;
    std::vector<std::uint32_t> to{0}, number;
    std::size_t end = first;
    for (; end < more.size() && (end == first || to.back() + std::uint64_t{found[more[end]]} <= kMostSlots); ++end) {
      part.add(asked, begin + more[end]);
      to.push_back(to.back() + found[more[end]]);
    }
    number.resize(part.rays.size());
    kernels.list_apart(variant, part.span(0, part.rays.size()), to, number, times);
    std::vector<std::uint32_t> cut;  // rays that the driver cut short only now
    for (std::size_t k = 0; k < number.size(); ++k) {
      const std::span<const Hit> mine = kernels.hits().subspan(to[k], to[k + 1] - to[k]);
      if (number[k] == UNFINISHED)
        cut.push_back(more[first + k]);
      else
        apart(more[first + k], {mine.begin(), mine.end()});
    }
    for (const std::uint32_t i : cut) apart(i, list_in_pieces(asked.span(begin + i, 1), times));
    first = end;
  }
}

/// Adds the crossings of rays from number `begin` on to the answers, each ray's in order.
void RayQueries::Parts::collect(std::size_t begin, const Lists& lists, Answers& answers) const {
  const std::size_t count = lists.places.size(), before_these = answers.counts.size();
  std::vector<std::uint64_t> to(count + 1, 0);
  answers.counts.resize(before_these + count);
  const auto number_of = [&](std::size_t i) { return order.empty() ? i : std::size_t(order[begin + i]) - begin; };
  for (std::size_t i = 0; i < count; ++i)
    answers.counts[before_these + number_of(i)] = std::min(lists.places[i].count, query.most);
  to[0] = answers.used;
  for (std::size_t i = 0; i < count; ++i) to[i + 1] = to[i] + answers.counts[before_these + i];
  answers.make_room(to[count] - to[0]);
  for_chunks(count, 1 << 12, [&](std::size_t first, std::size_t last) {
    std::vector<Hit> spare;
    for (std::size_t i = first; i < last; ++i) {
      const std::span<const Hit> mine = lists.of(lists.places[i]);
      const std::size_t n = number_of(i);
      put_in_order(asked.rays[begin + i], mine, std::span(answers.hits).subspan(to[n], to[n + 1] - to[n]), spare);
    }
  });
}

/// Writes the first crossings of a ray, as many as there is room for.
void RayQueries::Parts::put_in_order(const Ray& ray, std::span<const Hit> mine, std::span<Hit> to,
                                     std::vector<Hit>& spare) const {
  if (to.empty()) return;
  spare.assign(mine.begin(), mine.end());
  if (query.exact)
    exact_lists->put_in_order(ray, spare);
  else
    std::ranges::sort(spare, before);
  std::copy_n(spare.begin(), to.size(), to.begin());
}

RayQueries::RayQueries(Context& gpu, DeviceTree& tree, SurfaceAlpha alpha)
    : parts_(std::make_unique<Parts>(gpu, tree, std::move(alpha))) {}
RayQueries::~RayQueries() = default;

void RayQueries::set_counts_first(bool first) { parts_->counts_first = first; }

TraceTimes RayQueries::list(const RaySource& source, const TakeLists& take, const CrossingQuery& query) {
  Answers& answers = parts_->kept;
  return parts_->in_parts(source, query, [&](std::uint64_t first, std::size_t some, TraceTimes& times) {
    answers.clear();
    if (query.most == 0)
      answers.counts.resize(some);
    else if (parts_->by_counts)
      parts_->list_by_counts(0, some, answers, times);
    else
      parts_->list_with_room(answers, times);
    take(first, answers.counts, std::span<const Hit>(answers.hits).first(answers.used));
  });
}

}  // namespace ballot
