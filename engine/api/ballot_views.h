// How views of the caller's memory become those of the C interface. Not for use outside of ballot.h.
#pragma once

#include "ballot_types.h"

namespace ballot {
inline namespace v1 {
namespace detail {

/// Owns a handle of the C interface.
template <class T, void (*kClose)(T*)>
class Handle {
 public:
  Handle() = default;
  explicit Handle(T* handle) : handle_(handle) {}
  ~Handle() { kClose(handle_); }
  Handle(Handle&& other) noexcept : handle_(std::exchange(other.handle_, nullptr)) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  T* get() const { return handle_; }

 private:
  T* handle_ = nullptr;
};

/// Returns an array of zeros. Throws Error(BALLOT_ERROR_MEMORY) if there is no room for it.
template <class T>
std::vector<T> room_for(std::size_t count) {
  try {
    return std::vector<T>(count);
  } catch (const std::exception&) {  // bad_alloc, or more than a vector holds
    throw Error(BALLOT_ERROR_MEMORY, "the host has too little memory for " + std::to_string(count) + " results of " +
                                         std::to_string(sizeof(T)) + " bytes; ask for less at a time");
  }
}

inline std::size_t count_of(const std::size_t (&shape)[BALLOT_AXES]) {
  std::size_t count = shape[0];
  for (std::size_t a = 1; a < BALLOT_AXES && shape[a]; ++a) count *= shape[a];
  return count;
}

/// The columns of a view, as the C interface has them. Refers to them.
class Table {
 public:
  Table(std::string what, const Shape& from, std::size_t (&shape)[BALLOT_AXES])
      : what_(std::move(what)), shape_(shape), has_shape_(from[0] != 0) {
    std::copy(from.begin(), from.end(), shape);
  }
  /// Fills a column whose entries have `width` numbers. The longest one says how many questions there are, if the view
  /// has no shape. Throws Error(Argument) if its numbers are no multiple.
  void add(const Column& from, std::size_t width, std::string name, BallotColumn& to) {
    if (from.kind == Column::Kind::None) return;
    to.data = from.kind == Column::Kind::Own ? from.own.data() : from.data;
    to.type = from.type, to.gap = from.gap;
    std::copy(from.strides.begin(), from.strides.end(), to.stride);
    if (from.kind == Column::Kind::Strided) return;
    if (from.numbers % width || (from.kind == Column::Kind::Own && from.numbers != width))
      throw Error(BALLOT_ERROR_ARGUMENT, what_ + ": " + name + " has " + std::to_string(from.numbers) +
                                             " numbers; expected " + std::to_string(width) + " of each");
    rows_.push_back({&to, from.numbers / width, width * (from.type == BALLOT_FLOAT64 ? 8u : 4u), std::move(name)});
    if (!has_shape_ && (rows_.size() == 1 || shape_[0] == 1)) shape_[0] = rows_.back().entries;
  }
  /// Fills the words of filters.
  template <class View, class Questions>
  void add_filters(const View& view, Questions& to) {
    add(view.masks, 1, "masks", to.mask);
    add(view.excluded, 1, "excluded", to.excluded);
    add(view.groups, 1, "groups", to.group);
  }
  /// Sets the strides of numbers that lie side by side. Throws Error(Argument) unless they are one for all or as many
  /// as the questions.
  void fit() {
    for (const Row& row : rows_) {
      if (row.entries == 1) continue;
      if (row.entries != count_of(shape_))
        throw Error(BALLOT_ERROR_ARGUMENT, what_ + ": " + row.name + " has " + std::to_string(row.entries) + " for " +
                                               std::to_string(count_of(shape_)) + " " + what_ +
                                               "; expected as many, or one for all");
      auto stride = std::ptrdiff_t(row.bytes);
      std::size_t axes = 1;
      while (axes < BALLOT_AXES && shape_[axes]) ++axes;
      for (std::size_t a = axes; a-- > 0; stride *= std::ptrdiff_t(shape_[a])) row.to->stride[a] = stride;
    }
  }

 private:
  struct Row {
    BallotColumn* to;
    std::size_t entries, bytes;
    std::string name;
  };
  std::string what_;
  std::size_t (&shape_)[BALLOT_AXES];
  bool has_shape_;
  std::vector<Row> rows_;
};

inline BallotRays rays_of(const RayView& rays) {
  BallotRays r;
  Table table("rays", rays.shape, r.shape);
  table.add(rays.origins, 3, "origins", r.origin);
  table.add(rays.directions, 3, "directions", r.direction);
  table.add(rays.t_min, 1, "t_min", r.t_min);
  table.add(rays.t_max, 1, "t_max", r.t_max);
  table.add_filters(rays, r);
  table.add(rays.poses, 12, "poses", r.pose);
  table.add(rays.weights, 1, "weights", r.weight);
  table.fit();
  return r;
}
inline BallotRays rays_of(std::span<const Ray> rays) { return ballot_rays(rays.data(), rays.size()); }

inline BallotPoints points_of(const PointView& points) {
  BallotPoints p;
  Table table("points", points.shape, p.shape);
  table.add(points.at, 3, "at", p.at);
  table.add(points.limit, 1, "limit", p.limit);
  table.add_filters(points, p);
  table.add(points.x, 1, "x", p.x);
  table.add(points.y, 1, "y", p.y);
  table.add(points.z, 1, "z", p.z);
  table.fit();
  return p;
}

inline BallotBoxes boxes_of(const BoxView& boxes) {
  BallotBoxes b;
  Table table("boxes", boxes.shape, b.shape);
  table.add(boxes.low, 3, "low", b.low);
  table.add(boxes.high, 3, "high", b.high);
  table.add_filters(boxes, b);
  table.fit();
  return b;
}

inline BallotPoses poses_of(const PoseView& poses) {
  BallotPoses p;
  Table table("poses", poses.shape, p.shape);
  table.add(poses.pose, 12, "pose", p.pose);
  table.add(poses.limit, 1, "limit", p.limit);
  table.fit();
  constexpr auto kNone = Column::Kind::None;
  if (poses.shape[0] == 0 && poses.pose.kind == kNone && poses.limit.kind == kNone) p.shape[0] = 1;
  return p;
}

/// What lists go to.
struct Listing {
  explicit Listing(std::size_t questions)
      : all{room_for<std::int64_t>(questions), room_for<std::int64_t>(questions + 1), {}} {
    to.counts = all.counts.data(), to.offsets = all.offsets.data();
    to.take = &Listing::take, to.user = this;
  }
  Listing(const Listing&) = delete;
  Listing& operator=(const Listing&) = delete;

  static int take(void* user, std::uint64_t, std::size_t count, const std::uint32_t* counts, const BallotHit* hits) {
    auto& self = *static_cast<Listing*>(user);
    std::size_t total = 0;
    for (std::size_t i = 0; i < count; ++i) total += counts[i];
    try {
      self.all.hits.insert(self.all.hits.end(), hits, hits + total);
    } catch (...) {
      self.full = true;
    }
    return self.full;
  }
  /// Returns the lists of a call that has returned `status`.
  Lists end(BallotStatus status) {
    if (full) throw Error(BALLOT_ERROR_MEMORY, "the host has too little memory for all lists; ask for fewer at a time");
    check(status);
    return std::move(all);
  }

  Lists all;
  BallotLists to;
  bool full = false;  // there was no memory for more
};

/// Refuses sizes of pictures before memory is taken for them.
inline void check_size(std::uint32_t width, std::uint32_t height) {
  if (width < 1 || height < 1 || width > 16384 || height > 16384)
    throw Error(BALLOT_ERROR_ARGUMENT, "the picture is " + std::to_string(width) + " x " + std::to_string(height) +
                                           " pixels; expected 1 to 16384 each");
}

/// Returns the rays that make(rays, room, count) writes, of a view.
template <class R, class Make>
std::vector<R> made(std::uint32_t width, std::uint32_t height, const Make& make) {
  check_size(width, height);
  auto rays = room_for<R>(std::size_t{width} * height);
  std::size_t count = 0;
  make(rays.data(), rays.size(), &count);
  if (count > rays.size()) {  // kinds with several rays a pixel
    rays = room_for<R>(count);
    make(rays.data(), rays.size(), &count);
  }
  rays.resize(count);
  return rays;
}

/// The record of a type of array on the device.
template <class T>
struct RecordOf;
template <>
struct RecordOf<Ray> : std::integral_constant<BallotRecord, BALLOT_RECORD_RAY> {};
template <>
struct RecordOf<Hit> : std::integral_constant<BallotRecord, BALLOT_RECORD_HIT> {};
template <>
struct RecordOf<Point> : std::integral_constant<BallotRecord, BALLOT_RECORD_POINT> {};
template <>
struct RecordOf<NearestPoint> : std::integral_constant<BallotRecord, BALLOT_RECORD_NEAREST> {};
template <>
struct RecordOf<float> : std::integral_constant<BallotRecord, BALLOT_RECORD_FLOAT32> {};
template <>
struct RecordOf<std::array<float, 2>> : std::integral_constant<BallotRecord, BALLOT_RECORD_FLOAT32X2> {};
template <>
struct RecordOf<std::array<float, 3>> : std::integral_constant<BallotRecord, BALLOT_RECORD_FLOAT32X3> {};
template <>
struct RecordOf<std::array<float, 4>> : std::integral_constant<BallotRecord, BALLOT_RECORD_FLOAT32X4> {};
template <>
struct RecordOf<Vertex> : std::integral_constant<BallotRecord, BALLOT_RECORD_FLOAT32X3> {};
template <>
struct RecordOf<Matrix> : std::integral_constant<BallotRecord, BALLOT_RECORD_FLOAT32X12> {};
template <>
struct RecordOf<std::uint32_t> : std::integral_constant<BallotRecord, BALLOT_RECORD_UINT32> {};
template <>
struct RecordOf<std::uint8_t> : std::integral_constant<BallotRecord, BALLOT_RECORD_UINT8> {};
template <>
struct RecordOf<std::int64_t> : std::integral_constant<BallotRecord, BALLOT_RECORD_INT64> {};
template <>
struct RecordOf<double> : std::integral_constant<BallotRecord, BALLOT_RECORD_FLOAT64> {};

}  // namespace detail
}  // namespace v1
}  // namespace ballot
