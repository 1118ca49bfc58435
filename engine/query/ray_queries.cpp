#include "engine/query/ray_queries.h"

#include <algorithm>
#include <numeric>
#include <optional>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/parallel.h"
#include "engine/query/coherent_order.h"
#include "engine/query/query_kernel.h"

namespace ballot {

namespace {

constexpr std::size_t kMostSlots = 1 << 22;  // crossings that are listed at a time, 64 MiB
constexpr std::size_t kFirstSlots = 8;       // room for each ray in the first pass
constexpr std::size_t kFewRays = 1024;       // fewer are not sorted
constexpr std::size_t kRayChunk = 1 << 14;   // rays that a thread moves at a time
constexpr std::uint64_t kPieces[] = {8192, 1024, 128, 16, 0};

/// The crossings of some rays.
struct Lists {
  std::vector<std::uint32_t> counts;
  std::vector<Hit> hits;  // of all rays, one after the other
};

bool before(const Hit& a, const Hit& b) { return a.t != b.t ? a.t < b.t : a.prim < b.prim; }

template <class T>
Buffer<T>& room_for(std::optional<Buffer<T>>& buffer, Context& gpu, std::size_t count, const char* name) {
  if (!buffer || buffer->size() < count) {
    buffer.reset();
    buffer.emplace(gpu, count, Access::Storage, name);
  }
  return *buffer;
}

}  // namespace

struct RayQueries::Parts {
  Parts(Context& gpu_, DeviceTree& scene) : gpu(gpu_), whole(gpu_, scene) {}

  /// A kernel for whole trees, and one for pieces of them, which is made when the driver first cuts a walk short.
  struct Kernels {
    /// CPU devices walk the four-wide tree, whose nodes cost them less to read.
    void make(Context& device, DeviceTree& tree, int lists) {
      const bool wide = device.info().is_cpu();
      main.emplace(device, tree, "crossings", Defines{{"BALLOT_LISTS", lists}, {"BALLOT_WIDE", int(wide)}}, wide);
      pairs.reset();
      make_pairs = [this, &device, &tree, lists] {
        pairs.emplace(device, tree, "crossings", Defines{{"BALLOT_LISTS", lists}, {"BALLOT_WIDE", 0}});
      };
    }
    QueryKernel& of_pieces() {
      if (!pairs) make_pairs();
      pairs->prepare();
      return *pairs;
    }
    std::optional<QueryKernel> main, pairs;
    std::function<void()> make_pairs;
  };

  /// Makes kernels for the present tree.
  void prepare() {
    const bool other = whole.update();
    if (other || !counter.main) counter.make(gpu, whole.tree(), 0), lister.make(gpu, whole.tree(), 1);
  }

  /// Counts the crossings of rays below a node. Returns how many rays were cut short; their count is UNFINISHED.
  std::uint32_t count_below(QueryKernel& kernel, std::span<const Ray> some, std::uint32_t root,
                            std::span<std::uint32_t> found, TraceTimes& times) {
    kernel.bind(BIND_RAYS, upload(some));
    kernel.bind(BIND_CROSSINGS, room_for(counts, gpu, some.size(), "numbers of crossings"));
    const std::uint32_t unfinished = kernel.run(std::uint32_t(some.size()), root, times);
    counts->download(found);
    return unfinished;
  }

  /// Counts the crossings of rays in the whole tree.
  void count_all(std::span<const Ray> some, std::span<std::uint32_t> found, TraceTimes& times);

  /// The same. On a CPU device the rays go in an order in which neighbours are alike.
  void count_sorted(std::span<const Ray> some, std::span<std::uint32_t> found, TraceTimes& times) {
    if (!gpu.info().is_cpu() || some.size() < kFewRays) {
      count_all(some, found, times);
      return;
    }
    order_rays(some, whole.tree().bvh().bounds, order);
    sorted.resize(some.size()), sorted_counts.resize(some.size());
    for_chunks(some.size(), kRayChunk, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) sorted[i] = some[order[i]];
    });
    count_all(sorted, sorted_counts, times);
    for_chunks(some.size(), kRayChunk, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) found[order[i]] = sorted_counts[i];
    });
  }

  /// Lists crossings below a node. Ray i has room for those from slot to[i] on, up to slot to[i + 1].
  std::uint32_t list_below(QueryKernel& kernel, std::span<const Ray> some, std::uint32_t root,
                           std::span<const std::uint32_t> to, std::span<std::uint32_t> found, std::vector<Hit>& out,
                           TraceTimes& times) {
    Buffer<std::uint32_t>& room = room_for(places, gpu, to.size(), "places of crossings");
    room.upload(to);
    kernel.bind(BIND_RAYS, upload(some));
    kernel.bind(BIND_PLACES, room);
    kernel.bind(BIND_HITS, room_for(slots, gpu, to.back(), "crossings"));
    kernel.bind(BIND_CROSSINGS, room_for(counts, gpu, some.size(), "numbers of crossings"));
    const std::uint32_t unfinished = kernel.run(std::uint32_t(some.size()), root, times);
    counts->download(found);
    out.resize(to.back());
    if (!out.empty()) slots->download(std::span(out));
    return unfinished;
  }

  void list_all(std::span<const Ray> some, std::vector<std::vector<Hit>>& found, TraceTimes& times);
  void list_in_pieces(const Ray& ray, std::vector<Hit>& found, TraceTimes& times);

  const Buffer<Ray>& upload(std::span<const Ray> some) {
    Buffer<Ray>& buffer = room_for(rays, gpu, some.size(), "rays of a query");
    buffer.upload(some);
    return buffer;
  }

  [[noreturn]] void give_up(std::size_t open) const {
    fail(Failure::Work, "crossings: {} rays could not be finished on {}: its driver stops loops after a few iterations",
         open, gpu.info().name);
  }

  Context& gpu;
  WholeTree whole;
  Kernels counter, lister;
  std::optional<Buffer<Ray>> rays;
  std::optional<Buffer<std::uint32_t>> counts, places;
  std::optional<Buffer<Hit>> slots;
  std::vector<std::uint32_t> order, sorted_counts;
  std::vector<Ray> sorted;
};

void RayQueries::Parts::count_all(std::span<const Ray> some, std::span<std::uint32_t> found, TraceTimes& times) {
  if (count_below(*counter.main, some, whole.tree().root(), found, times) == 0) return;
  // Walks that the driver cut short are repeated in ever smaller pieces of the tree.
  std::vector<std::uint32_t> open;
  for (std::uint32_t i = 0; i < found.size(); ++i)
    if (found[i] == UNFINISHED) open.push_back(i);
  times.retraced += open.size();
  QueryKernel& kernel = counter.of_pieces();
  for (const std::uint64_t limit : kPieces) {
    std::vector<Ray> part;
    for (const std::uint32_t i : open) part.push_back(some[i]);
    std::vector<std::uint32_t> piece(part.size()), sum(part.size(), 0), still;
    for (const std::uint32_t root : kernel.pieces(limit)) {
      count_below(kernel, part, root, piece, times);
      for (std::size_t k = 0; k < part.size(); ++k)
        sum[k] = sum[k] == UNFINISHED || piece[k] == UNFINISHED ? UNFINISHED : sum[k] + piece[k];
    }
    for (std::size_t k = 0; k < open.size(); ++k) {
      found[open[k]] = sum[k];
      if (sum[k] == UNFINISHED) still.push_back(open[k]);
    }
    open = std::move(still);
    if (open.empty()) return;
  }
  give_up(open.size());
}

/// Lists the crossings of one ray whose walk the driver cut short.
void RayQueries::Parts::list_in_pieces(const Ray& ray, std::vector<Hit>& found, TraceTimes& times) {
  ++times.retraced;
  QueryKernel &count = counter.of_pieces(), &list = lister.of_pieces();
  for (const std::uint64_t limit : kPieces) {
    found.clear();
    bool cut = false;
    for (const std::uint32_t root : list.pieces(limit)) {
      std::uint32_t number = 0;
      cut = count_below(count, {&ray, 1}, root, {&number, 1}, times) > 0;
      if (cut) break;
      if (number == 0) continue;
      std::vector<Hit> part;
      const std::uint32_t to[2] = {0, number};
      cut = list_below(list, {&ray, 1}, root, to, {&number, 1}, part, times) > 0;
      if (cut) break;
      found.insert(found.end(), part.begin(), part.end());
    }
    if (!cut) return;
  }
  give_up(1);
}

/// A first pass has a little room for each ray; the rays that need more get it in further passes.
void RayQueries::Parts::list_all(std::span<const Ray> some, std::vector<std::vector<Hit>>& found, TraceTimes& times) {
  std::vector<std::uint32_t> open(some.size()), needed(some.size(), kFirstSlots), number;
  if (gpu.info().is_cpu() && some.size() >= kFewRays)
    order_rays(some, whole.tree().bvh().bounds, open);
  else
    std::iota(open.begin(), open.end(), 0u);
  std::vector<Ray> part;
  std::vector<std::uint32_t> to, again, again_needed;
  std::vector<Hit> hits;
  while (!open.empty()) {
    again.clear(), again_needed.clear();
    for (std::size_t begin = 0; begin < open.size();) {
      part.clear();
      to.assign(1, 0);
      std::size_t end = begin;
      for (; end < open.size() && (end == begin || to.back() + std::uint64_t{needed[end]} <= kMostSlots); ++end) {
        part.push_back(some[open[end]]);
        to.push_back(to.back() + needed[end]);
      }
      number.resize(part.size());
      list_below(*lister.main, part, whole.tree().root(), to, number, hits, times);
      for (std::size_t k = 0; k < part.size(); ++k) {
        std::vector<Hit>& mine = found[open[begin + k]];
        if (number[k] == UNFINISHED) {
          list_in_pieces(part[k], mine, times);
        } else if (number[k] > to[k + 1] - to[k]) {
          again.push_back(open[begin + k]), again_needed.push_back(number[k]);
        } else {
          mine.assign(hits.begin() + to[k], hits.begin() + to[k] + number[k]);
        }
      }
      begin = end;
    }
    open.swap(again), needed.swap(again_needed);
  }
}

RayQueries::RayQueries(Context& gpu, DeviceTree& tree) : parts_(std::make_unique<Parts>(gpu, tree)) {}
RayQueries::~RayQueries() = default;

TraceTimes RayQueries::count(const RaySource& source, const TakeCounts& take) {
  TraceTimes times;
  if (source.count == 0) return times;
  const PassScope scope(parts_->gpu);
  parts_->prepare();
  parts_->counter.main->prepare();
  const std::size_t chunk = std::size_t(std::min<std::uint64_t>(source.count, parts_->counter.main->most()));
  std::vector<Ray> rays(chunk);
  std::vector<std::uint32_t> found(chunk);
  for (std::uint64_t first = 0; first < source.count; first += chunk) {
    const std::size_t some = std::size_t(std::min<std::uint64_t>(chunk, source.count - first));
    source.read(first, std::span(rays).first(some));
    parts_->count_sorted(std::span(rays).first(some), std::span(found).first(some), times);
    take(first, std::span(found).first(some));
    if (source.progress) source.progress(first + some);
  }
  return times;
}

TraceTimes RayQueries::list(const RaySource& source, std::uint32_t most, const TakeLists& take) {
  TraceTimes times;
  if (source.count == 0) return times;
  const PassScope scope(parts_->gpu);
  parts_->prepare();
  parts_->lister.main->prepare();
  const std::size_t chunk = std::size_t(std::min<std::uint64_t>(source.count, kMostSlots / kFirstSlots));
  std::vector<Ray> rays(chunk);
  std::vector<std::vector<Hit>> found(chunk);
  Lists lists;
  for (std::uint64_t first = 0; first < source.count; first += chunk) {
    const std::size_t some = std::size_t(std::min<std::uint64_t>(chunk, source.count - first));
    source.read(first, std::span(rays).first(some));
    parts_->list_all(std::span(rays).first(some), found, times);
    for_chunks(some, 1 << 12, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        std::ranges::sort(found[i], before);
        if (found[i].size() > most) found[i].resize(most);
      }
    });
    lists.counts.clear(), lists.hits.clear();
    for (std::size_t i = 0; i < some; ++i) {
      lists.counts.push_back(std::uint32_t(found[i].size()));
      lists.hits.insert(lists.hits.end(), found[i].begin(), found[i].end());
      found[i].clear();
    }
    take(first, lists.counts, lists.hits);
    if (source.progress) source.progress(first + some);
  }
  return times;
}

}  // namespace ballot
