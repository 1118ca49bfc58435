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

/// Lists the records of questions on the device, part by part, behind each other. Returns the number of all; none if
/// the host has to look: if the driver cut a walk short, or lists are too long to be put in order here.
template <class Question, class Record>
std::optional<std::uint64_t> list_there(Context& gpu, ListKind<Question, Record>& kind,
                                        ListRooms<Question, Record>& rooms, const Buffer<Question>& questions,
                                        std::uint64_t count, const DeviceLists<Record>& to, TraceTimes& times) {
  ListStages<Question, Record> stages(gpu, kind, rooms);
  const bool counts_alone = !to.records && kind.has_rest();
  const auto first_kernel = [&](std::size_t some) -> QueryKernel& {
    return counts_alone ? kind.kernel(ListForm::Numbers, false) : stages.to_rows(some);
  };
  const std::size_t row = counts_alone ? 1 : kind.row();
  const std::uint32_t size =
      part_size(gpu, std::min<std::size_t>({first_kernel(0).most(), kListChunk, kMostRecords / row}));
  const std::uint32_t longest = gpu.info().is_cpu() ? kMostInOrderOfCpu : kMostInOrder;
  const auto room = std::uint32_t(std::min<std::uint64_t>(to.records ? to.records->size() : 0, ~0u));
  buffer_for(rooms.appended, gpu, 1, "sum of lists").record_upload(std::vector<AppendedLists>(1));
  QuestionParts<Question> parts(gpu, questions, count);
  const std::function<void(std::uint32_t)> none;
  for (std::uint64_t first = 0; first < count; first += size) {
    const auto some = std::uint32_t(std::min<std::uint64_t>(size, count - first));
    const typename ListStages<Question, Record>::Asked asked{parts.of(first, some), words_of(to.counts, first, some),
                                                             some, none};
    QueryKernel& kernel = first_kernel(some);
    kind.bind_masks_there(kernel, first, some);
    if (stages.walk(kernel, asked, times) > 0) return {};
    const std::uint64_t words = (some + std::uint64_t{1}) * sizeof(std::int64_t);
    if (to.offsets)
      stages.append(asked, {*to.offsets, first * sizeof(std::int64_t), words}, room, times);
    else
      stages.append(asked, buffer_for(rooms.offsets, gpu, std::bit_ceil(some) + 1, "offsets of lists"), room, times);
    if (to.records && kind.has_rest() && stages.walk(stages.to_places(*to.records), asked, times) > 0) return {};
    if (to.records) stages.put_in_order(asked, *to.records, LONGEST_LIST, times);
    if (to.records && kind.has_rest()) stages.put_long_in_order(asked, *to.records, longest, times);
    gpu.flush();
    check_interruption();
  }
  AppendedLists all{};
  rooms.appended->download(std::span(&all, 1));
  if (to.records && all.longest > longest) return {};
  return std::uint64_t{all.high} << 32 | all.low;
}

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
template <class Record>
void check_there(std::uint64_t questions, const char* name, const DeviceLists<Record>& to, std::uint64_t count) {
  check_there(questions, count, "lists", name);
  check_there(to.counts.size(), count, "lists", "counts");
  if (to.offsets) check_there(to.offsets->size(), count + 1, "lists", "offsets");
}

}  // namespace ballot
