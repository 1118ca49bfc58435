// Counts of crossings.
#include <deque>

#include "engine/answer/ray_parts.h"
#include "engine/answer/stream.h"

namespace ballot {

using namespace ray_queries;

namespace {

/// Rays whose crossings are counted in pieces of the tree.
struct CountWalks {
  using Answer = std::uint32_t;
  static constexpr const char* kQueries = "rays";

  CrossingKernels& kernels;
  const CrossingVariant& variant;
  const ListPart<Ray>& asked;
  TraceTimes& times;
  ListPart<Ray> part = {};

  static std::uint32_t none() { return 0; }
  static std::string name() { return "crossings"; }
  void choose(std::span<const std::uint32_t> numbers) {
    part = {};
    for (const std::uint32_t i : numbers) part.add(asked.questions, asked.words, i);
  }
  std::vector<TreePiece> pieces(std::uint64_t limit) { return kernels.pieces(variant, limit); }
  void ask(const TreePiece& piece, std::span<std::uint32_t> found) {
    kernels.count(variant, part, found, times, piece);
  }
  static void add(std::size_t, std::uint32_t& all, std::uint32_t found) { add_count(all, found); }
};

}  // namespace

/// Counts the crossings of a stream of rays.
class RayQueries::Parts::CountAnswerer : public Answerer<Ray, std::uint32_t> {
 public:
  CountAnswerer(Parts& parts, const RaySource& source) : parts_(parts), source_(source) {}
  std::size_t most() const override {
    return std::min<std::size_t>(parts_.kernels.kernel(parts_.variant, false).most(), kChunk);
  }
  void arrange(std::span<Ray> rays) override {
    const bool sorts = rays.size() >= kFewRays && order_rays(rays, parts_.kernels.tree().bvh().bounds, order_);
    if (sorts)
      rearranged_.arrange(rays, order_);
    else
      order_.clear();
  }
  void answer(const Chunk<Ray, std::uint32_t>& chunk, TraceTimes& times) override {
    FilterWords& words = words_.emplace_back(source_.filters.read(chunk.first, chunk.here.size()));
    words.arrange(order_);
    if (parts_.kernels.count_there(parts_.variant, chunk, words, times) == 0) return;
    std::vector<std::uint32_t> counts(chunk.here.size());
    chunk.answers.download(counts);
    RayPart asked{chunk.here.part(0, chunk.here.size()), words};
    CountWalks walks{parts_.kernels, parts_.variant, asked, times};
    repair(walks, std::span(counts), kFirstPieces, parts_.gpu, times);
    chunk.answers.upload(counts);
  }
  std::span<const std::uint32_t> end(const Questions<Ray>& rays, std::span<std::uint32_t> counts) override {
    const FilterWords words = std::move(words_.front());
    words_.pop_front();
    if (parts_.query.exact) parts_.exact_lists->count(rays.all(), words, counts);
    return order_.empty() ? counts : rearranged_.back(counts, order_);
  }

 private:
  Parts& parts_;
  const RaySource& source_;
  std::vector<std::uint32_t> order_;  // of the chunk under way; empty: as they came
  Rearranged<Ray, std::uint32_t> rearranged_;
  std::deque<FilterWords> words_;  // of the chunks whose counts have not come yet
};

TraceTimes RayQueries::count(const RaySource& source, const TakeCounts& take, const CrossingQuery& query) {
  if (source.count == 0) return {};
  parts_->begin(source.filters.bits(), query);
  Stream<Ray, std::uint32_t> stream{
      .most = source.count, .make = source.make, .take = take, .progress = source.progress};
  stream.next = [&](std::uint64_t first, std::span<Ray> room) {
    source.read(first, room);
    return room.size();
  };
  Parts::CountAnswerer answerer(*parts_, source);
  return StreamRing::of(parts_->gpu).run(stream, answerer);
}

}  // namespace ballot
