#include "engine/api/sources.h"

#include <algorithm>
#include <atomic>
#include <cstring>

namespace ballot::api {

namespace {

constexpr std::size_t kBlock = 64;  // records that are gathered at a time
constexpr float kNoBound = std::numeric_limits<float>::max();
constexpr float kNoLimit = std::numeric_limits<float>::infinity();
static_assert(sizeof(BallotRay) == sizeof(Ray) && sizeof(ProbePoint) == 4 * sizeof(float));

/// Returns the bytes that a distance in memory spans; too many for any memory where there is no sum.
std::size_t span_of(std::ptrdiff_t stride, std::size_t steps) {
  const std::size_t bytes = stride < 0 ? 0 - std::size_t(stride) : std::size_t(stride);
  return bytes && steps > kMostBytes / bytes ? kMostBytes : bytes * steps;
}

/// Copies `n` entries of kNumbers numbers, which are `step` bytes apart, to floats of records.
template <class From, std::size_t kNumbers>
void gather(const char* from, std::ptrdiff_t stride, std::ptrdiff_t step, std::size_t n, float* to,
            std::size_t record) {
  for (std::size_t k = 0; k < n; ++k, from += stride, to += record)
    for (std::size_t i = 0; i < kNumbers; ++i) {
      From number;
      std::memcpy(&number, from + std::ptrdiff_t(i) * step, sizeof number);
      to[i] = float(number);
    }
}

template <class From>
void gather(std::size_t numbers, const char* from, std::ptrdiff_t stride, std::ptrdiff_t step, std::size_t n, float* to,
            std::size_t record) {
  if (numbers == 1)
    gather<From, 1>(from, stride, 0, n, to, record);
  else if (step == sizeof(From))
    gather<From, 3>(from, stride, sizeof(From), n, to, record);
  else
    gather<From, 3>(from, stride, step, n, to, record);
}

}  // namespace

template <std::size_t kFloats>
Columns<kFloats>::Columns(const char* what, const std::size_t (&shape)[BALLOT_AXES], const Record& defaults, float most,
                          std::initializer_list<Given> given)
    : common_(defaults), most_(most) {
  for (; axes_ < BALLOT_AXES && (axes_ == 0 || shape[axes_]); ++axes_) {
    shape_[axes_] = shape[axes_];
    if (shape[axes_] && count_ > kMostBytes / shape[axes_])
      refuse(fmt::format("{}: the shape has {} in an axis; no memory reaches that far: expected fewer than 2^47 in all",
                         what, shape[axes_]));
    count_ *= shape[axes_];
  }
  for (const Given& one : given) add(what, one);
  if (float& last = common_.back(); last > most_) last = most_;
  join_axes();
  whole_ = holds_records();
}

/// Adds a column, or reads what is the same for all.
template <std::size_t kFloats>
void Columns<kFloats>::add(const char* what, const Given& given) {
  const BallotColumn& c = given.column;
  if (c.type != BALLOT_FLOAT32 && c.type != BALLOT_FLOAT64)
    refuse(
        fmt::format("{}: the type of {} is {}; expected BALLOT_FLOAT32 or BALLOT_FLOAT64", what, given.name, c.type));
  if (count_ == 0) return;
  if (!c.data && given.needed)
    refuse(fmt::format("{}: the data of {} are NULL, but there are {}", what, given.name, count_));
  if (!c.data) return;
  const std::size_t size = c.type == BALLOT_FLOAT64 ? sizeof(double) : sizeof(float);
  bool varies = false;
  std::size_t reach = span_of(c.gap, 2);
  for (std::size_t a = 0; a < axes_; ++a) {
    varies = varies || (c.stride[a] && shape_[a] > 1);
    reach += span_of(c.stride[a], shape_[a] - 1);
    if (reach >= kMostBytes)
      refuse(
          fmt::format("{}: the stride of {} is {} bytes, along an axis of {}, and its gap {} bytes; no memory "
                      "reaches that far: expected less than 2^47 bytes in all",
                      what, given.name, c.stride[a], shape_[a], c.gap));
  }
  Part part{static_cast<const char*>(c.data),
            {},
            std::ptrdiff_t(size) + c.gap,
            size == sizeof(double),
            given.numbers,
            given.at};
  std::copy_n(c.stride, BALLOT_AXES, part.stride.begin());
  if (varies)
    parts_.push_back(part);
  else if (part.is_double)
    gather<double>(part.numbers, part.data, 0, part.step, 1, &common_[part.at], kFloats);
  else
    gather<float>(part.numbers, part.data, 0, part.step, 1, &common_[part.at], kFloats);
}

/// Drops axes of one entry, and joins those that every part walks as one.
template <std::size_t kFloats>
void Columns<kFloats>::join_axes() {
  std::size_t kept = 0;
  for (std::size_t a = 0; a < axes_; ++a) {
    if (shape_[a] == 1) continue;
    const bool joins = kept > 0 && std::ranges::all_of(parts_, [&](const Part& part) {
                         return part.stride[kept - 1] == part.stride[a] * std::ptrdiff_t(shape_[a]);
                       });
    if (joins)
      shape_[kept - 1] *= shape_[a];
    else
      shape_[kept++] = shape_[a];
    for (Part& part : parts_) part.stride[kept - 1] = part.stride[a];
  }
  axes_ = kept;
}

template <std::size_t kFloats>
bool Columns<kFloats>::holds_records() const {
  std::size_t floats = 0;
  for (const Part& part : parts_) {
    floats += part.numbers;
    if (part.is_double || (part.numbers > 1 && part.step != sizeof(float)) ||
        part.data != parts_[0].data + (part.at - parts_[0].at) * sizeof(float) ||
        !std::equal(part.stride.begin(), part.stride.begin() + std::ptrdiff_t(axes_), parts_[0].stride.begin()))
      return false;
  }
  return floats == kFloats;
}

template <std::size_t kFloats>
const typename Columns<kFloats>::Record* Columns<kFloats>::packed() const {
  if (!whole_ || axes_ != 1 || parts_[0].stride[0] != sizeof(Record)) return nullptr;
  if (reinterpret_cast<std::uintptr_t>(parts_[0].data) % alignof(Record)) return nullptr;
  return reinterpret_cast<const Record*>(parts_[0].data);
}

template <std::size_t kFloats>
const char* Columns<kFloats>::Part::of(const std::array<std::size_t, BALLOT_AXES>& index, std::size_t axes) const {
  const char* entry = data;
  for (std::size_t a = 0; a < axes; ++a) entry += std::ptrdiff_t(index[a]) * stride[a];
  return entry;
}

template <std::size_t kFloats>
void Columns<kFloats>::read(std::size_t place, std::size_t n, Record* to) const {
  if (parts_.empty()) {
    for (std::size_t k = 0; k < n; ++k) std::memcpy(to + k, &common_, sizeof(Record));
    return;
  }
  const std::size_t last = axes_ - 1;
  std::array<Record, kBlock> block;
  std::array<std::size_t, BALLOT_AXES> index;
  for (std::size_t some = 0; n > 0; place += some, n -= some, to += some) {
    index[0] = place;
    for (std::size_t a = last, rest = place; a > 0; --a) {
      index[a] = rest % shape_[a];
      index[a - 1] = rest /= shape_[a];
    }
    some = std::min({n, kBlock, shape_[last] - index[last]});
    if (whole_) {
      const char* from = parts_[0].of(index, axes_);
      for (std::size_t k = 0; k < some; ++k, from += parts_[0].stride[last]) {
        Record record;
        std::memcpy(&record, from, sizeof record);
        if (record.back() > most_) record.back() = most_;
        std::memcpy(to + k, &record, sizeof record);
      }
      continue;
    }
    std::fill_n(block.begin(), some, common_);
    for (const Part& part : parts_) {
      const char* from = part.of(index, axes_);
      float* first = &block[0][part.at];
      if (part.is_double)
        gather<double>(part.numbers, from, part.stride[last], part.step, some, first, kFloats);
      else
        gather<float>(part.numbers, from, part.stride[last], part.step, some, first, kFloats);
    }
    for (std::size_t k = 0; k < some; ++k)
      if (block[k].back() > most_) block[k].back() = most_;
    std::memcpy(to, block.data(), some * sizeof(Record));  // at once: `to` may be memory that is slow to write in parts
  }
}

RayArray::RayArray(const BallotRays& rays)
    : columns_("rays", rays.shape, {0, 0, 0, 0, 0, 0, 0, kNoBound}, kNoBound,
               {{"origin", rays.origin, 3, 0, true},
                {"t_min", rays.t_min, 1, 3},
                {"direction", rays.direction, 3, 4, true},
                {"t_max", rays.t_max, 1, 7}}) {}

void RayArray::read(const RowOrder& order, std::size_t first, std::span<Ray> rays) const {
  auto* records = reinterpret_cast<Columns<8>::Record*>(rays.data());
  for_chunks(rays.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    order.for_runs(first + begin, end - begin, [&](std::size_t i, std::size_t place, std::size_t n) {
      columns_.read(place, n, records + begin + i);
    });
  });
}

const Ray* RayArray::in_place(std::size_t first, std::size_t count) const {
  const auto* records = columns_.packed();
  if (!records) return nullptr;
  std::atomic<bool> as_they_are{true};
  for_chunks(count, kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      if (records[first + i].back() > kNoBound) as_they_are = false;
  });
  return as_they_are ? reinterpret_cast<const Ray*>(records + first) : nullptr;
}

PointArray::PointArray(const BallotPoints& points)
    : columns_("points", points.shape, {0, 0, 0, kNoLimit}, kNoLimit,
               {{"at", points.at, 3, 0, true}, {"limit", points.limit, 1, 3}}) {
  if (const float limit = columns_.common()[3]; !(limit > 0))
    refuse(fmt::format("points: limit is {}; expected a distance above 0, or none", limit));
}

void PointArray::read(std::uint64_t first, std::span<ProbePoint> points) const {
  auto* records = reinterpret_cast<Columns<4>::Record*>(points.data());
  for_chunks(points.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    columns_.read(std::size_t(first) + begin, end - begin, records + begin);
  });
}

}  // namespace ballot::api
