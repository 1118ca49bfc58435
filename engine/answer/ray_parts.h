// What answers ray queries for more than one hit. Internal to engine/answer.
#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "engine/answer/coherent_order.h"
#include "engine/answer/crossing_kernels.h"
#include "engine/answer/exact_lists.h"
#include "engine/answer/repair.h"

namespace ballot {

// Named, as RayQueries::Parts holds types of it.
namespace ray_queries {

constexpr std::uint32_t kMostSlots = 1 << 22;  // crossings that are listed at a time, 64 MiB
constexpr std::uint32_t kFirstSlots = 8;       // room for each ray in the first pass
constexpr std::uint32_t kMostFirst = 16;       // first crossings that a kernel looks for; of more, all are listed
constexpr std::size_t kFewRays = 1024;         // fewer are not sorted
constexpr std::size_t kRayChunk = 1 << 14;     // rays that a thread moves at a time

inline bool before(const Hit& a, const Hit& b) { return a.t != b.t ? a.t < b.t : a.prim < b.prim; }

/// The rays of a part of a query, in the order in which they are asked.
struct RayPart {
  std::vector<Ray> rays;
  std::vector<std::uint32_t> masks;  // of each, or none

  RaySpan span(std::size_t begin, std::size_t count) const {
    RaySpan some{std::span(rays).subspan(begin, count)};
    if (!masks.empty()) some.masks = std::span(masks).subspan(begin, count);
    return some;
  }
  void resize(std::size_t count, bool with_masks) { rays.resize(count), masks.resize(with_masks ? count : 0); }
  void take(const RayPart& from, std::size_t i, std::size_t to) {
    rays[to] = from.rays[i];
    if (!masks.empty()) masks[to] = from.masks[i];
  }
  void add(const RayPart& from, std::size_t i) {
    rays.push_back(from.rays[i]);
    if (!from.masks.empty()) masks.push_back(from.masks[i]);
  }
};

/// The crossings of rays that were asked together, before they are put into order. Those of most rays lie in slots; few
/// rays have a list of their own.
struct Lists {
  struct Place {
    std::uint32_t begin = 0, count = 0, apart = 0;  // apart: 1 and the number of a list of its own, or 0
  };
  std::span<const Hit> of(const Place& p) const {
    return p.apart ? std::span<const Hit>(apart[p.apart - 1]) : slots.subspan(p.begin, p.count);
  }
  std::span<const Hit> slots;
  std::vector<Place> places;  // of each ray
  std::vector<std::vector<Hit>> apart;
};

/// A count of crossings, to which those of another piece of the tree are added.
inline void add_count(std::uint32_t& all, std::uint32_t found) {
  all = all == UNSURE || found == UNSURE ? UNSURE : all + found;
}

/// One ray whose crossings are listed in pieces of the tree.
struct ListWalk {
  struct Answer {
    std::uint32_t number = 0;
    std::vector<Hit> hits = {};
  };
  static constexpr const char* kQueries = "rays";

  CrossingKernels& kernels;
  CrossingVariant counting, listing;
  RaySpan ray;
  TraceTimes& times;

  static Answer none() { return {}; }
  static std::string name() { return "crossings"; }
  static void choose(std::span<const std::uint32_t>) {}
  std::vector<TreePiece> pieces(std::uint64_t limit) { return kernels.pieces(listing, limit); }
  void ask(const TreePiece& piece, std::span<Answer> found) {
    std::uint32_t& number = found[0].number;
    found[0].hits.clear();
    kernels.count(counting, ray, {&number, 1}, times, piece);
    if (number == 0 || number >= UNSURE) return;
    const std::uint32_t to[2] = {0, number};
    kernels.list_apart(listing, ray, to, {&number, 1}, times, piece);
    found[0].hits.assign(kernels.hits().begin(), kernels.hits().end());
  }
  static void add(std::size_t, Answer& all, const Answer& found) {
    add_count(all.number, found.number);
    all.hits.insert(all.hits.end(), found.hits.begin(), found.hits.end());
  }
};

inline bool is_unfinished(const ListWalk::Answer& a) { return a.number == UNFINISHED; }

/// The crossings of rays in the order in which they came.
struct Answers {
  std::vector<std::uint32_t> counts;
  std::vector<Hit> hits;  // the first `used`: memory that stays is not written twice
  std::size_t used = 0;

  void clear() { counts.clear(), used = 0; }
  void make_room(std::size_t more) {
    used += more;
    if (hits.size() < used) hits.resize(used);
  }
};

}  // namespace ray_queries

struct RayQueries::Parts {
  using RayPart = ray_queries::RayPart;
  using Lists = ray_queries::Lists;
  using Answers = ray_queries::Answers;

  Parts(Context& device, DeviceTree& scene, SurfaceAlpha alpha)
      : gpu(device), kernels(device, scene, std::move(alpha)) {}

  void read(const RaySource& source, std::uint64_t first, std::size_t count);
  class CountAnswerer;
  void list_with_room(Answers& answers, TraceTimes& times);
  void list_by_counts(std::size_t begin, std::size_t count, Answers& answers, TraceTimes& times);
  void list_open(std::size_t begin, Lists& lists, TraceTimes& times);
  std::vector<Hit> list_in_pieces(const RaySpan& ray, TraceTimes& times);
  void collect(std::size_t begin, const Lists& lists, Answers& answers) const;
  void put_in_order(const Ray& ray, std::span<const Hit> found, std::span<Hit> to, std::vector<Hit>& spare) const;

  /// Begins a query: makes its kernels for the present tree.
  void begin(const RaySource& source, const CrossingQuery& wanted, bool lists);
  /// Begins a query for lists, reads its rays in parts, and calls answer(first, number, times) for each.
  template <class Answer>
  TraceTimes in_parts(const RaySource& source, const CrossingQuery& wanted, const Answer& answer) {
    TraceTimes times;
    if (source.count == 0) return times;
    const PassScope scope(gpu);
    begin(source, wanted, true);
    const std::uint64_t most = ray_queries::kMostSlots / room;
    for (std::uint64_t first = 0, some = 0; first < source.count; first += some) {
      some = std::min(most, source.count - first);
      read(source, first, std::size_t(some));
      answer(first, std::size_t(some), times);
      if (source.progress) source.progress(first + some);
    }
    return times;
  }

  Context& gpu;
  CrossingKernels kernels;
  CrossingQuery query;
  CrossingVariant variant;
  std::optional<ExactLists> exact_lists;  // of a query in mode exact
  std::optional<bool> counts_first;
  bool by_counts = false;
  std::uint32_t room = ray_queries::kFirstSlots;  // of each ray in the first pass
  RayPart given, asked;              // the rays of a part as they came, and in the order in which they are asked
  std::vector<std::uint32_t> order;  // the number of each asked ray among those that came; empty: its own
  std::vector<std::uint32_t> found;
  Answers kept;  // of the parts of a query, one after the other
};

}  // namespace ballot
