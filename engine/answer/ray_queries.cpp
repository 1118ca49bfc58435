#include "engine/answer/ray_queries.h"

#include "engine/answer/crossing_lists.h"
#include "engine/core/error.h"

namespace ballot {

using namespace ray_queries;

void RayQueries::Parts::begin(std::uint32_t filters, const CrossingQuery& wanted) {
  if (wanted.alpha && wanted.exact)
    fail(Failure::Arguments,
         "crossings: found alpha and mode exact; expected one of them: textures are read in float32");
  query = wanted;
  variant = {.exact = query.exact,
             .alpha = query.alpha && kernels.has_alpha(),
             .filters = kernels.prepare(filters, query.triangle_masks),
             .cull = query.cull};
  exact_lists.reset();
  if (query.exact) check_takes(find_numeric("exact"), kernels.tree().facts().shapes);
  if (query.exact) exact_lists.emplace(kernels.tree(), query);
}

void ray_queries::check_most(std::uint32_t most, const CrossingQuery& query) {
  if (most == 0) fail(Failure::Arguments, "first crossings: found 0 of each ray; expected at least 1");
  if (query.last && most > kMostFirst)
    fail(Failure::Arguments, "last crossings: found {} of each ray; expected 1 to {}", most, kMostFirst);
}

/// Answers rays by rows of first crossings.
class RayQueries::Parts::FirstAnswerer : public Answerer<Ray, Hit> {
 public:
  FirstAnswerer(Parts& parts, Crossings& crossings)
      : parts_(parts), crossings_(crossings), lists_(parts.gpu, crossings, parts.rooms) {}
  std::size_t most() const override {
    return std::min<std::size_t>(crossings_.kernel(ListForm::Rows, false).most(),
                                 kChunk / std::bit_ceil(crossings_.row()));
  }
  std::size_t width() const override { return crossings_.row(); }
  void arrange(std::span<Ray> rays) override {
    if (rays.size() >= kFewRays && crossings_.order(rays, order_))
      rearranged_.arrange(rays, order_);
    else
      order_.clear();
  }
  void answer(const Chunk<Ray, Hit>& chunk, TraceTimes& times) override {
    FilterWords words = crossings_.words(chunk.first, chunk.here.size());
    words.arrange(order_);
    QueryKernel& kernel = crossings_.kernel(ListForm::Rows, false);
    crossings_.bind_words(kernel, chunk.here.size(), words, false);
    kernel.bind(BIND_RAYS, chunk.questions);
    kernel.bind(BIND_RECORDS, chunk.answers);
    kernel.bind(BIND_CROSSINGS, buffer_for(parts_.numbers, parts_.gpu, chunk.here.size(), "numbers of crossings"));
    if (kernel.answer(0, chunk.count(), crossings_.whole(), times, chunk.launched) > 0) finish(chunk, words, times);
  }
  std::span<const Hit> end(const Questions<Ray>&, std::span<Hit> hits) override {
    return order_.empty() ? hits : rearranged_.back(hits, order_, width());
  }

 private:
  /// Answers the rays that the driver cut short.
  void finish(const Chunk<Ray, Hit>& chunk, const FilterWords& words, TraceTimes& times) {
    std::vector<std::uint32_t> found(chunk.here.size());
    parts_.numbers->download(found);
    for (std::size_t i = 0; i < found.size(); ++i) {
      if (found[i] != UNFINISHED) continue;
      RayPart one;
      one.add(chunk.here.all(), words, i);
      std::vector<Hit> hits = lists_.list_in_pieces(one);
      crossings_.put_in_order(chunk.here.all()[i], hits);
      hits.resize(width(), kMiss);
      chunk.answers.upload(hits, i * width());
    }
    times += std::exchange(lists_.again(), {});
  }

  Parts& parts_;
  Crossings& crossings_;
  ListAnswerer<Ray, Hit> lists_;
  std::vector<std::uint32_t> order_;  // of the chunk under way; empty: as they came
  Rearranged<Ray, Hit> rearranged_;
};

RayQueries::RayQueries(Context& gpu, DeviceTree& tree, SurfaceAlpha alpha)
    : parts_(std::make_unique<Parts>(gpu, tree, std::move(alpha))) {}
RayQueries::~RayQueries() = default;

Context& RayQueries::context() { return parts_->gpu; }

namespace {

auto reader_of(const RaySource& source) {
  return [&source](std::uint64_t first, std::span<Ray> room) {
    source.read(first, room);
    return room.size();
  };
}

/// Takes lists as rows of `most` crossings.
TakeLists in_rows(std::uint32_t most, const TakeFirst& take) {
  constexpr std::size_t kHits = 1 << 20;  // that are taken at a time
  return [&take, most, rows = std::vector<Hit>()](std::uint64_t first, std::span<const std::uint32_t> counts,
                                                  std::span<const Hit> hits) mutable {
    const std::size_t some = std::max<std::size_t>(1, kHits / most);
    for (; !counts.empty(); counts = counts.subspan(std::min(some, counts.size())), first += some) {
      const std::size_t n = std::min(some, counts.size());
      rows.assign(n * most, kMiss);
      for (std::size_t i = 0; i < n; hits = hits.subspan(counts[i++]))
        std::copy_n(hits.begin(), counts[i], rows.begin() + std::ptrdiff_t(i * most));
      take(first, rows);
    }
  };
}

}  // namespace

TraceTimes RayQueries::list(const RaySource& source, const TakeLists& take, const CrossingQuery& query) {
  if (source.count == 0) return {};
  parts_->begin(source.filters.bits(), query);
  if (query.most == 0) {
    const std::vector<std::uint32_t> none(std::min<std::uint64_t>(source.count, kChunk));
    for (std::uint64_t first = 0; first < source.count; first += none.size())
      take(first, std::span(none).first(std::min<std::uint64_t>(none.size(), source.count - first)), {});
    return {};
  }
  Parts::Crossings crossings(*parts_, source);
  ListAnswerer<Ray, Hit> answerer(parts_->gpu, crossings, parts_->rooms);
  Stream<Ray, std::uint32_t> stream{.most = source.count, .make = source.make, .progress = source.progress};
  stream.next = reader_of(source);
  stream.take = [&](std::uint64_t first, std::span<const std::uint32_t> counts) {
    take(first, counts, answerer.records());
  };
  TraceTimes times = StreamRing::of(parts_->gpu).run(stream, answerer);
  times += answerer.again();
  return times;
}

TraceTimes RayQueries::first(const RaySource& source, std::uint32_t most, const TakeFirst& take,
                             const CrossingQuery& wanted) {
  check_most(most, wanted);
  CrossingQuery query = wanted;
  query.most = most;
  if (most > kMostFirst || query.exact) return list(source, in_rows(most, take), query);
  if (source.count == 0) return {};
  parts_->begin(source.filters.bits(), query);
  Parts::Crossings crossings(*parts_, source);
  Parts::FirstAnswerer answerer(*parts_, crossings);
  Stream<Ray, Hit> stream{.most = source.count, .make = source.make, .take = take, .progress = source.progress};
  stream.next = reader_of(source);
  return StreamRing::of(parts_->gpu).run(stream, answerer);
}

}  // namespace ballot
