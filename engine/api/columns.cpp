#include "engine/api/columns.h"

#include <algorithm>

#include "engine/core/parallel.h"

namespace ballot::api {

namespace {

// Records of which the parts are written one after the other. Memory that a device shares is slow where the writes to a
// line of it lie far apart in time.
constexpr std::size_t kBlock = 16;
constexpr std::size_t kEntries = 1 << 13;           // of a table, that a thread writes at a time
constexpr std::size_t kMostWords = (1u << 28) / 4;  // of all tables
constexpr std::size_t kShare = 4;                   // tables are at most a part of the questions, one in so many
constexpr std::size_t kFewMade = 1 << 12;           // fewer questions are not worth it

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

Shape read_shape(const char* what, const std::size_t (&shape)[BALLOT_AXES]) {
  Shape read;
  for (std::size_t& a = read.axes; a < BALLOT_AXES && (a == 0 || shape[a]); ++a) {
    read.lengths[a] = shape[a];
    if (shape[a] && read.count > kMostBytes / shape[a])
      refuse(fmt::format("{}: the shape has {} in an axis; no memory reaches that far: expected fewer than 2^47 in all",
                         what, shape[a]));
    read.count *= shape[a];
  }
  return read;
}

/// Throws Refused if a column has a wrong type, or no data where it is needed.
static void check_given(const Described& d, const Shape& shape, const BallotColumn& c) {
  const bool fits = d.words ? c.type == BALLOT_UINT32 : c.type == BALLOT_FLOAT32 || c.type == BALLOT_FLOAT64;
  if (!fits && (!d.words || (c.data && shape.count)))
    refuse(fmt::format("{}: the type of {} is {}; expected {}", d.what, d.name, c.type,
                       d.words ? "BALLOT_UINT32" : "BALLOT_FLOAT32 or BALLOT_FLOAT64"));
  if (shape.count && !c.data && d.needed)
    refuse(fmt::format("{}: the data of {} are NULL, but there are {}", d.what, d.name, shape.count));
}

Column read_column(const Described& d, const Shape& shape, const BallotColumn& c) {
  check_given(d, shape, c);
  Column column{.numbers = d.numbers};
  if (shape.count == 0 || !c.data) return column;
  column.is_given = true;
  column.is_double = c.type == BALLOT_FLOAT64;
  column.step = c.gap + std::ptrdiff_t(column.is_double ? sizeof(double) : sizeof(float));
  bool varies = false;
  std::size_t reach = span_of(c.gap, d.numbers - 1);
  for (std::size_t a = 0; a < shape.axes; ++a) {
    column.stride[a] = shape.lengths[a] > 1 ? c.stride[a] : 0;
    varies = varies || column.stride[a];
    reach += span_of(c.stride[a], shape.lengths[a] - 1);
    if (reach >= kMostBytes)
      refuse(
          fmt::format("{}: the stride of {} is {} bytes, along an axis of {}, and its gap {} bytes; no memory "
                      "reaches that far: expected less than 2^47 bytes in all",
                      d.what, d.name, c.stride[a], shape.lengths[a], c.gap));
  }
  const auto* data = static_cast<const char*>(c.data);
  if (varies)
    column.data = data;
  else if (d.words)
    std::memcpy(column.own.data(), data, sizeof column.own[0]);
  else
    for (unsigned k = 0; k < d.numbers; ++k) {
      const float number = column.number(data, k);
      column.own[k] = std::bit_cast<std::uint32_t>(number);
      column.own_doubles[k] = number;
      if (column.is_double) std::memcpy(&column.own_doubles[k], data + std::ptrdiff_t(k) * column.step, sizeof(double));
    }
  return column;
}

Lane::Lane(const Column& column, const Shape& shape) : column_(column) {
  std::size_t& kept = shape_.axes;
  for (std::size_t a = 0; a < shape.axes; ++a) {
    if (shape.lengths[a] == 1) continue;
    const std::ptrdiff_t stride = column.stride[a];
    if (kept > 0 && column_.stride[kept - 1] == stride * std::ptrdiff_t(shape.lengths[a]))
      shape_.lengths[kept - 1] *= shape.lengths[a];
    else
      shape_.lengths[kept++] = shape.lengths[a];
    column_.stride[kept - 1] = stride;
  }
  shape_.count = shape.count;
}

Lane Lane::entries() const {
  Shape shape = shape_;
  shape.count = 1;
  for (std::size_t a = 0; a < shape.axes; ++a) {
    if (column_.stride[a] == 0) shape.lengths[a] = 1;
    shape.count *= shape.lengths[a];
  }
  return {column_, shape};
}

template <std::size_t Floats>
Columns<Floats>::Columns(const Shape& shape, const std::array<Column, Floats / 2>& columns, const Record& defaults,
                         float most)
    : parts_(columns), common_(defaults), most_(most) {
  for (std::size_t i = 0; i < parts_.size(); ++i)
    for (unsigned k = 0; parts_[i].is_given && !parts_[i].data && k < parts_[i].numbers; ++k)
      common_[i / 2 * 4 + i % 2 * 3 + k] = parts_[i].own_number(k);
  for (Column& part : parts_)
    if (!part.data) part.step = sizeof(float), part.is_double = false;  // it is read from `common_`
  join_axes(shape);
  whole_ = holds_records();
}

/// Drops axes of one entry, and joins those that every part walks as one.
template <std::size_t Floats>
void Columns<Floats>::join_axes(const Shape& shape) {
  std::size_t kept = 0;
  for (std::size_t a = 0; a < shape.axes; ++a) {
    if (shape.lengths[a] == 1) continue;
    const bool joins = kept > 0 && std::ranges::all_of(parts_, [&](const Column& part) {
                         return part.stride[kept - 1] == part.stride[a] * std::ptrdiff_t(shape.lengths[a]);
                       });
    if (joins)
      shape_[kept - 1] *= shape.lengths[a];
    else
      shape_[kept++] = shape.lengths[a];
    for (Column& part : parts_) part.stride[kept - 1] = part.stride[a];
  }
  axes_ = kept;
}

template <std::size_t Floats>
bool Columns<Floats>::holds_records() const {
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const Column& part = parts_[i];
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

template class Columns<4>;
template class Columns<8>;

namespace {

/// Appends what a column has to the words of tables, each entry once. `where`: its strides.
void add_table(const TableOf& of, const Shape& shape, const MadeColumn& where, std::span<std::uint32_t> words) {
  const Column& c = of.column;
  std::uint32_t* to = &words[where.at];
  if (!c.data) {
    for (unsigned k = 0; k < c.numbers; ++k)
      to[k] = std::bit_cast<std::uint32_t>(std::min(c.is_given ? c.own_number(k) : of.absent[k % 3], of.most));
    return;
  }
  Shape entries = shape;
  entries.count = 1;
  for (std::size_t a = 0; a < shape.axes; ++a) entries.count *= entries.lengths[a] = c.stride[a] ? shape.lengths[a] : 1;
  const Lane lane(c, entries);
  for_chunks(entries.count, kEntries, [&](std::size_t begin, std::size_t end) {
    lane.for_runs(begin, end - begin, [&](std::size_t i, std::size_t n, const char* from, std::ptrdiff_t stride) {
      std::uint32_t* put = to + (begin + i) * c.numbers;
      for (std::size_t k = 0; k < n; ++k, from += stride)
        for (unsigned number = 0; number < c.numbers; ++number) {
          const float x = c.number(from, number);
          *put++ = std::bit_cast<std::uint32_t>(x > of.most ? of.most : x);
        }
    });
  });
}

/// Joins axes that all columns walk as one, and drops those of one entry.
void join_axes(MadeQuestions& how, std::size_t columns) {
  std::uint32_t kept = 0;
  for (std::uint32_t a = 0; a < how.axes; ++a) {
    if (how.shape[a] == 1) continue;
    const std::span<MadeColumn> all(how.columns, columns);
    const bool joins = kept > 0 && std::ranges::all_of(all, [&](const MadeColumn& c) {
                         return c.stride[kept - 1] == c.stride[a] * how.shape[a];
                       });
    how.shape[joins ? kept - 1 : kept] = joins ? how.shape[kept - 1] * how.shape[a] : how.shape[a];
    kept += !joins;
    for (MadeColumn& c : all) c.stride[kept - 1] = c.stride[a];
  }
  how.axes = kept;
}

}  // namespace

std::optional<QuestionTables> tables_of(Made kind, const Shape& shape, const RowOrder& order,
                                        std::span<const TableOf> columns) {
  if (shape.count < kFewMade || shape.count > ~std::uint32_t{0}) return {};
  QuestionTables made{kind, {}, {}};
  MadeQuestions& how = made.how;
  how.axes = std::uint32_t(shape.axes);
  for (std::size_t a = 0; a < shape.axes; ++a) how.shape[a] = std::uint32_t(shape.lengths[a]);
  how.width = std::uint32_t(order.width()), how.tiled = std::uint32_t(order.tiled());
  const std::size_t record = kind == Made::Points ? sizeof(ProbePoint) / 4 : sizeof(Ray) / 4;
  const std::size_t most = std::min(kMostWords, shape.count * record / kShare);
  std::size_t words = 0;
  for (std::size_t k = 0; k < columns.size(); ++k) {
    const Column& c = columns[k].column;
    how.columns[k].at = std::uint32_t(words);
    std::size_t own = c.numbers;
    for (std::size_t a = shape.axes; a-- > 0;) {
      if (c.stride[a]) how.columns[k].stride[a] = std::uint32_t(own), own *= shape.lengths[a];
      if (words + own > most) return {};
    }
    words += own;
  }
  made.words.resize(words);
  for (std::size_t k = 0; k < columns.size(); ++k) add_table(columns[k], shape, how.columns[k], made.words);
  join_axes(how, columns.size());
  return made;
}

}  // namespace ballot::api
