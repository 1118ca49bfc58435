#include "engine/api/sources.h"

#include <algorithm>
#include <atomic>
#include <cstring>

namespace ballot::api {

namespace {

// Records of which the parts are written one after the other. Memory that a device shares is slow where the writes to a
// line of it lie far apart in time.
constexpr std::size_t kBlock = 16;
constexpr float kNoBound = std::numeric_limits<float>::max();
constexpr float kNoLimit = std::numeric_limits<float>::infinity();
static_assert(sizeof(BallotRay) == sizeof(Ray) && sizeof(ProbePoint) == 4 * sizeof(float));

/// Returns the bytes that a distance in memory spans; too many for any memory where there is no sum.
std::size_t span_of(std::ptrdiff_t stride, std::size_t steps) {
  const std::size_t bytes = stride < 0 ? 0 - std::size_t(stride) : std::size_t(stride);
  return bytes && steps > kMostBytes / bytes ? kMostBytes : bytes * steps;
}

template <class From>
float number_at(const char* from) {
  From number;
  std::memcpy(&number, from, sizeof number);
  return float(number);
}

/// Where numbers of questions lie, and the bytes to those of the next question.
struct Walk {
  const char* from;
  std::ptrdiff_t stride;
};

/// Gathers three numbers, which are `step` bytes apart, and one, at most `most`, to each of `n` records.
template <class Three, class One>
void gather(Walk three, std::ptrdiff_t step, Walk one, float most, std::size_t n, float* to, std::size_t record) {
  for (std::size_t k = 0; k < n; ++k, three.from += three.stride, one.from += one.stride, to += record) {
    const float x = number_at<Three>(three.from), y = number_at<Three>(three.from + step),
                z = number_at<Three>(three.from + 2 * step), last = number_at<One>(one.from);
    to[0] = x, to[1] = y, to[2] = z, to[3] = last > most ? most : last;
  }
}

/// Copies records whose last number is at most `most`. The last four numbers go one by one: a record that is written in
/// part before it is read as a whole waits for the write.
template <class Record>
void copy_records(Walk records, float most, std::span<Record> to) {
  constexpr std::size_t kWhole = std::tuple_size_v<Record> - 4;
  for (std::size_t k = 0; k < to.size(); ++k, records.from += records.stride) {
    const char* from = records.from + kWhole * sizeof(float);
    const float a = number_at<float>(from), b = number_at<float>(from + 4), c = number_at<float>(from + 8),
                last = number_at<float>(from + 12);
    float* put = to[k].data();
    if constexpr (kWhole > 0) std::memcpy(put, records.from, kWhole * sizeof(float));
    put[kWhole] = a, put[kWhole + 1] = b, put[kWhole + 2] = c, put[kWhole + 3] = last > most ? most : last;
  }
}

}  // namespace

template <std::size_t Floats>
Columns<Floats>::Columns(const char* what, const std::size_t (&shape)[BALLOT_AXES], const Record& defaults, float most,
                         const std::array<Given, Floats / 2>& given)
    : common_(defaults), most_(most) {
  for (; axes_ < BALLOT_AXES && (axes_ == 0 || shape[axes_]); ++axes_) {
    shape_[axes_] = shape[axes_];
    if (shape[axes_] && count_ > kMostBytes / shape[axes_])
      refuse(fmt::format("{}: the shape has {} in an axis; no memory reaches that far: expected fewer than 2^47 in all",
                         what, shape[axes_]));
    count_ *= shape[axes_];
  }
  for (std::size_t i = 0; i < parts_.size(); ++i) parts_[i] = part_of(what, given[i], i);
  join_axes();
  whole_ = holds_records();
}

/// Returns a column as it is read. Reads what is the same for all.
template <std::size_t Floats>
typename Columns<Floats>::Part Columns<Floats>::part_of(const char* what, const Given& given, std::size_t number) {
  const BallotColumn& c = given.column;
  const Part common{nullptr, {}, sizeof(float), false};
  if (c.type != BALLOT_FLOAT32 && c.type != BALLOT_FLOAT64)
    refuse(
        fmt::format("{}: the type of {} is {}; expected BALLOT_FLOAT32 or BALLOT_FLOAT64", what, given.name, c.type));
  if (count_ == 0) return common;
  if (!c.data && given.needed)
    refuse(fmt::format("{}: the data of {} are NULL, but there are {}", what, given.name, count_));
  if (!c.data) return common;
  const bool is_double = c.type == BALLOT_FLOAT64;
  Part part{static_cast<const char*>(c.data), {}, c.gap, is_double};
  bool varies = false;
  std::size_t reach = span_of(c.gap, 2);
  for (std::size_t a = 0; a < axes_; ++a) {
    part.stride[a] = shape_[a] > 1 ? c.stride[a] : 0;
    varies = varies || part.stride[a];
    reach += span_of(c.stride[a], shape_[a] - 1);
    if (reach >= kMostBytes)
      refuse(
          fmt::format("{}: the stride of {} is {} bytes, along an axis of {}, and its gap {} bytes; no memory "
                      "reaches that far: expected less than 2^47 bytes in all",
                      what, given.name, c.stride[a], shape_[a], c.gap));
  }
  part.step += std::ptrdiff_t(is_double ? sizeof(double) : sizeof(float));
  if (varies) return part;
  const bool is_one = number % 2 == 1;
  for (std::size_t i = 0; i < (is_one ? 1u : 3u); ++i) {
    const char* from = part.data + std::ptrdiff_t(i) * part.step;
    common_[number / 2 * 4 + (is_one ? 3 : i)] = is_double ? number_at<double>(from) : number_at<float>(from);
  }
  return common;
}

/// Drops axes of one entry, and joins those that every part walks as one.
template <std::size_t Floats>
void Columns<Floats>::join_axes() {
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

template <std::size_t Floats>
bool Columns<Floats>::holds_records() const {
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const Part& part = parts_[i];
    const bool is_there = part.data && part.data == parts_[0].data + (i / 2 * 4 + i % 2 * 3) * sizeof(float);
    if (!is_there || part.is_double || (i % 2 == 0 && part.step != sizeof(float)) || part.stride != parts_[0].stride)
      return false;
  }
  return true;
}

template <std::size_t Floats>
const typename Columns<Floats>::Record* Columns<Floats>::packed() const {
  if (!whole_ || axes_ != 1 || parts_[0].stride[0] != sizeof(Record)) return nullptr;
  if (reinterpret_cast<std::uintptr_t>(parts_[0].data) % alignof(Record)) return nullptr;
  return reinterpret_cast<const Record*>(parts_[0].data);
}

template <std::size_t Floats>
const char* Columns<Floats>::entry(std::size_t part, const std::array<std::size_t, BALLOT_AXES>& index) const {
  const char* from = parts_[part].data;
  if (!from) return reinterpret_cast<const char*>(&common_[part / 2 * 4 + part % 2 * 3]);
  for (std::size_t a = 0; a < axes_; ++a) from += std::ptrdiff_t(index[a]) * parts_[part].stride[a];
  return from;
}

template <std::size_t Floats>
void Columns<Floats>::read(std::size_t place, std::size_t n, Record* to) const {
  constexpr auto kInfinity = std::numeric_limits<float>::infinity();
  const std::size_t last = axes_ ? axes_ - 1 : 0;
  std::array<std::size_t, BALLOT_AXES> index;
  for (std::size_t some = 0; n > 0; place += some, n -= some, to += some) {
    index[0] = place;
    for (std::size_t a = last, rest = place; a > 0; --a) {
      index[a] = rest % shape_[a];
      index[a - 1] = rest /= shape_[a];
    }
    some = std::min({n, whole_ ? n : kBlock, axes_ ? shape_[last] - index[last] : n});
    if (whole_) {
      copy_records({entry(0, index), parts_[0].stride[last]}, most_, std::span(to, some));
      continue;
    }
    for (std::size_t part = 0; part < parts_.size(); part += 2) {
      const Walk three{entry(part, index), parts_[part].stride[last]};
      const Walk one{entry(part + 1, index), parts_[part + 1].stride[last]};
      const float most = part + 2 == parts_.size() ? most_ : kInfinity;
      const auto work = parts_[part].is_double
                            ? parts_[part + 1].is_double ? gather<double, double> : gather<double, float>
                        : parts_[part + 1].is_double ? gather<float, double>
                                                     : gather<float, float>;
      work(three, parts_[part].step, one, most, some, to->data() + 2 * part, Floats);
    }
  }
}

MaskColumn::MaskColumn(const char* what, const std::size_t (&shape)[BALLOT_AXES], std::size_t count,
                       const BallotColumn& given)
    : given_(given.data != nullptr) {
  if (!given_ || count == 0) return;
  if (given.type != BALLOT_UINT32)
    refuse(fmt::format("{}: the type of mask is {}; expected BALLOT_UINT32", what, given.type));
  bool varies = false;
  std::size_t reach = 0;
  for (; axes_ < BALLOT_AXES && shape[axes_]; ++axes_) {
    shape_[axes_] = shape[axes_];
    stride_[axes_] = shape[axes_] > 1 ? given.stride[axes_] : 0;
    varies = varies || stride_[axes_];
    reach += span_of(stride_[axes_], shape[axes_] - 1);
    if (reach >= kMostBytes)
      refuse(
          fmt::format("{}: the stride of mask is {} bytes, along an axis of {}; no memory reaches that far: expected "
                      "less than 2^47 bytes in all",
                      what, stride_[axes_], shape[axes_]));
  }
  if (varies)
    data_ = static_cast<const char*>(given.data);
  else
    std::memcpy(&common_, given.data, sizeof common_);
}

void MaskColumn::read(std::size_t place, std::span<std::uint32_t> to) const {
  if (!data_) {
    std::ranges::fill(to, common_);
    return;
  }
  const std::size_t last = axes_ - 1;
  for (std::size_t i = 0; i < to.size();) {
    const char* from = data_;
    std::size_t index = place + i;
    const std::size_t some = std::min(to.size() - i, shape_[last] - index % shape_[last]);
    for (std::size_t a = last + 1; a-- > 0; index /= shape_[a]) from += std::ptrdiff_t(index % shape_[a]) * stride_[a];
    for (const std::size_t end = i + some; i < end; ++i, from += stride_[last]) std::memcpy(&to[i], from, sizeof to[i]);
  }
}

RayArray::RayArray(const BallotRays& rays)
    : columns_("rays", rays.shape, {0, 0, 0, 0, 0, 0, 0, kNoBound}, kNoBound,
               {{{"origin", rays.origin, true},
                 {"t_min", rays.t_min, false},
                 {"direction", rays.direction, true},
                 {"t_max", rays.t_max, false}}}),
      masks_("rays", rays.shape, columns_.count(), rays.mask) {}

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

PointArray::PointArray(const BallotPoints& points, bool needs_limit)
    : columns_("points", points.shape, {0, 0, 0, kNoLimit}, kNoLimit,
               {{{"at", points.at, true}, {"limit", points.limit, needs_limit}}}),
      masks_("points", points.shape, columns_.count(), points.mask) {
  const float limit = columns_.common()[3];
  if (!(needs_limit ? limit >= 0 : limit > 0))
    refuse(fmt::format("points: limit is {}; expected a distance {}", limit,
                       needs_limit ? "that is not below 0" : "above 0, or none"));
}

void PointArray::read(std::uint64_t first, std::span<ProbePoint> points) const {
  auto* records = reinterpret_cast<Columns<4>::Record*>(points.data());
  for_chunks(points.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    columns_.read(std::size_t(first) + begin, end - begin, records + begin);
  });
}

}  // namespace ballot::api
