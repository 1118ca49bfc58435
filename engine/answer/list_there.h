// Lists of arrays that stay on the device. Internal to engine/answer.
#pragma once

#include "engine/answer/device_lists.h"
#include "engine/answer/lists.h"
#include "engine/core/error.h"
#include "engine/core/interruption.h"

namespace ballot {

/// Records of lists that a workgroup puts in order: more would keep it for too long. A CPU device may cut its loops.
inline constexpr std::uint32_t kMostInOrder = 1 << 14, kMostInOrderOfCpu = 1 << 10;

/// Hands out parts of an array of questions, as kernels bind them.
template <class Question>
class QuestionParts {
 public:
  QuestionParts(Context& gpu, const Buffer<Question>& all, std::uint64_t count) : gpu_(gpu), all_(all), count_(count) {}
  /// Valid until the next call. Parts begin at multiples of some power of two of at least 64.
  BufferPart of(std::uint64_t first, std::uint32_t count) {
    if (count == count_) return all_;
    if (!gpu_.info().is_cpu()) return {all_, first * sizeof(Question), std::uint64_t{count} * sizeof(Question)};
    Buffer<Question>& part =
        buffer_for(part_, gpu_, std::bit_ceil(count), "a part of questions");  // texels: a whole one
    part.copy_from(all_, std::size_t(first), 0, count);
    return part;
  }

 private:
  Context& gpu_;
  const Buffer<Question>& all_;
  std::uint64_t count_;
  std::unique_ptr<Buffer<Question>> part_;
};

/// Returns the questions of a part of an array: a power of two, `most` at most.
inline std::uint32_t part_size(Context& gpu, std::size_t most) {
  return std::uint32_t(std::bit_floor(std::min(most, StreamRing::of(gpu).most())));
}

/// Returns the words of a part of an array of words.
inline BufferPart words_of(const Buffer<std::uint32_t>& all, std::uint64_t first, std::uint32_t count) {
  return {all, first * sizeof(std::uint32_t), count * sizeof(std::uint32_t)};
}

/// Makes the lists of an array of questions on the device, part by part, each behind the one before. A call returns
/// nothing if the host has to look: if the driver cut a walk short, or a list is too long to be put in order here.
template <class Question, class Record>
class ListsThere {
 public:
  using Kind = ListKind<Question, Record>;
  using Rooms = ListRooms<Question, Record>;

  /// Keeps references to all.
  ListsThere(Context& gpu, Kind& kind, Rooms& rooms, const Buffer<Question>& questions, std::uint64_t count,
             TraceTimes& times)
      : gpu_(gpu),
        kind_(kind),
        rooms_(rooms),
        stages_(gpu, kind, rooms),
        count_(count),
        times_(times),
        parts_(gpu, questions, count) {}

  /// Returns the number of records of all lists.
  std::optional<std::uint64_t> list(const DeviceLists<Record>& to) {
    const bool cuts = kind_.has_rest() && kind_.most() != ~0u, rows = to.records || !kind_.has_rest();
    const std::uint32_t room = to.records ? room_of(*to.records) : 0;
    begin(rooms_.appended);
    for (std::uint64_t first = 0; first < count_;) {
      std::uint32_t some = begin_part(first, size(rows ? kind_.row() : 1));
      if (!walk(rows, first, some, to.counts)) return {};
      if (cuts && to.records && !make_whole(first, some, to.counts)) return {};
      const Asked asked = part(first, some, to.counts);
      if (cuts) pick(PICK_COUNTS, asked, {});
      append(asked, first, to.offsets, room);
      if (to.records && cuts) pick(PICK_LISTS, asked, BufferPart(*to.records));
      if (to.records && !cuts && !fill(asked, *to.records)) return {};
      first += some;
      gpu_.flush();
      check_interruption();
    }
    const AppendedLists all = read(*rooms_.appended);
    if (to.records && !cuts && all.longest > longest()) return {};
    return std::uint64_t{all.high} << 32 | all.low;
  }

  /// Writes rows of the first records, filled up with misses. `numbers` has room for those of all questions. Returns
  /// false for nothing.
  bool rows(Buffer<std::uint32_t>& numbers, Buffer<Record>& to) {
    const std::uint64_t row = kind_.most() * sizeof(Record);
    for (std::uint64_t first = 0; first < count_;) {
      std::uint32_t some = begin_part(first, size(kind_.row()));
      if (!walk(true, first, some, numbers) || !make_whole(first, some, numbers)) return false;
      pick(PICK_ROWS, part(first, some, numbers), BufferPart(to, first * row, some * row));
      first += some;
      gpu_.flush();
      check_interruption();
    }
    gpu_.finish();
    return true;
  }

 private:
  using Asked = typename ListStages<Question, Record>::Asked;

  std::uint32_t longest() const { return gpu_.info().is_cpu() ? kMostInOrderOfCpu : kMostInOrder; }
  static std::uint32_t room_of(const Buffer<Record>& to) {
    return std::uint32_t(std::min<std::uint64_t>(to.size(), ~0u));
  }
  std::uint32_t size(std::size_t row) {
    const std::size_t of_kernel = kind_.kernel(ListForm::Rows, false).most();
    return part_size(gpu_, std::min<std::size_t>({of_kernel, kListChunk, kMostRecords / row}));
  }
  std::uint32_t begin_part(std::uint64_t first, std::uint32_t size) const {
    return std::uint32_t(std::min<std::uint64_t>(size, count_ - first));
  }
  Asked part(std::uint64_t first, std::uint32_t some, Buffer<std::uint32_t>& counts) {
    return {parts_.of(first, some), words_of(counts, first, some), some, none_};
  }
  void begin(std::unique_ptr<Buffer<AppendedLists>>& sum) {
    buffer_for(sum, gpu_, 1, "sum of lists").record_upload(std::vector<AppendedLists>(1));
  }
  static AppendedLists read(const Buffer<AppendedLists>& sum) {
    AppendedLists all{};
    sum.download(std::span(&all, 1));
    return all;
  }

  /// Numbers the records of a part, and writes the first to `rows` if wanted.
  bool walk(bool rows, std::uint64_t first, std::uint32_t some, Buffer<std::uint32_t>& counts) {
    QueryKernel& kernel = rows ? stages_.to_rows(some) : kind_.kernel(ListForm::Numbers, false);
    kind_.bind_words_there(kernel, first, some);
    return stages_.walk(kernel, part(first, some, counts), times_) == 0;
  }
  void append(const Asked& asked, std::uint64_t first, Buffer<std::int64_t>* offsets, std::uint32_t room) {
    const std::uint64_t word = sizeof(std::int64_t);
    const std::uint32_t some = asked.count;
    const BufferPart begins = offsets ? BufferPart(*offsets, first * word, (some + std::uint64_t{1}) * word)
                                      : buffer_for(rooms_.offsets, gpu_, std::bit_ceil(some) + 1, "offsets of lists");
    stages_.append(asked, begins, room, *rooms_.appended, times_);
  }
  /// Writes the lists of a part to their places.
  bool fill(const Asked& asked, Buffer<Record>& records) {
    if (kind_.has_rest() && stages_.walk(stages_.to_places(records), asked, times_) > 0) return false;
    stages_.put_in_order(asked, records, LONGEST_LIST, times_);
    if (kind_.has_rest()) stages_.put_long_in_order(asked, records, longest(), times_);
    return true;
  }

  /// Makes the whole lists of a part in memory between. Halves the part until they fit.
  bool make_whole(std::uint64_t first, std::uint32_t& some, Buffer<std::uint32_t>& counts) {
    for (;; some = std::bit_ceil(some) / 2) {
      begin(rooms_.part);
      const Asked asked = part(first, some, counts);
      stages_.append(asked, buffer_for(rooms_.offsets, gpu_, std::bit_ceil(some) + 1, "offsets of lists"), ~0u,
                     *rooms_.part, times_);
      const AppendedLists sum = read(*rooms_.part);
      if (sum.longest > longest()) return false;
      if (sum.high || sum.low > kMostRecords) continue;
      Buffer<Record>& whole = buffer_for(rooms_.records_apart, gpu_, std::max(sum.low, 1u), "whole lists");
      if (!fill(asked, whole)) return false;
      std::swap(rooms_.places, rooms_.whole_places);
      return true;
    }
  }
  void pick(std::uint32_t step, const Asked& asked, std::optional<BufferPart> to) {
    refresh(gpu_, rooms_.pick, pick_source());
    const BufferPart& unused = asked.numbers;
    rooms_.pick->bind(BIND_CROSSINGS, asked.numbers);
    rooms_.pick->bind(BIND_WHOLE_PLACES, rooms_.whole_places ? BufferPart(*rooms_.whole_places) : unused);
    rooms_.pick->bind(BIND_PLACES, step == PICK_LISTS ? BufferPart(*rooms_.places) : unused);
    rooms_.pick->bind(BIND_ROWS, to ? BufferPart(*rooms_.records_apart) : unused);
    rooms_.pick->bind(BIND_RECORDS, to ? *to : unused);
    stages_.pass(*rooms_.pick, asked.count / ORDER_GROUP + 1, PickPush{asked.count, step, kind_.most()}, times_);
  }

  Context& gpu_;
  Kind& kind_;
  Rooms& rooms_;
  ListStages<Question, Record> stages_;
  std::uint64_t count_;
  TraceTimes& times_;
  QuestionParts<Question> parts_;
  std::function<void(std::uint32_t)> none_;
};

/// Writes lists that come from a stream to arrays on the device.
template <class Record>
class DeviceListsSink {
 public:
  explicit DeviceListsSink(const DeviceLists<Record>& to) : to_(to) {
    const std::int64_t zero = 0;
    if (to_.offsets) to_.offsets->upload({&zero, 1});
  }
  void take(std::uint64_t first, std::span<const std::uint32_t> counts, std::span<const Record> records) {
    to_.counts.upload(counts, std::size_t(first));
    offsets_.assign(1, std::int64_t(sum_));
    for (const std::uint32_t n : counts) offsets_.push_back(offsets_.back() + std::int64_t{n});
    if (to_.offsets) to_.offsets->upload(offsets_, std::size_t(first));
    const std::uint64_t room = to_.records ? to_.records->size() : 0;
    if (sum_ < room) to_.records->upload(records.first(std::min<std::uint64_t>(records.size(), room - sum_)), sum_);
    sum_ = std::uint64_t(offsets_.back());
  }
  std::uint64_t sum() const { return sum_; }

 private:
  DeviceLists<Record> to_;
  std::vector<std::int64_t> offsets_;
  std::uint64_t sum_ = 0;
};

/// Throws Error(Arguments) if an array has fewer records than a call needs.
inline void check_there(std::uint64_t has, std::uint64_t count, const char* what, const char* name) {
  if (has < count) fail(Failure::Arguments, "{} on the device: found {} {}; expected {}", what, has, name, count);
}
inline void check_there(const DeviceFilters& filters, std::uint64_t count, const char* what) {
  constexpr const char* kNames[FILTERS] = {"masks", "excluded triangles", "groups"};
  for (std::size_t f = 0; f < FILTERS; ++f)
    if (filters.of[f]) check_there(filters.of[f]->size(), count, what, kNames[f]);
}
template <class Record>
void check_there(std::uint64_t questions, const char* name, const DeviceLists<Record>& to, std::uint64_t count) {
  check_there(questions, count, "lists", name);
  check_there(to.counts.size(), count, "lists", "counts");
  if (to.offsets) check_there(to.offsets->size(), count + 1, "lists", "offsets");
}

}  // namespace ballot
