// Arrays on the device that tests of lists ask and are answered by.
#pragma once

#include <gtest/gtest.h>

#include <cstring>

#include "engine/answer/ray_queries.h"

namespace ballot {

/// The rays of a source, and their words, on the device.
class RaysThere {
 public:
  RaysThere(Context& gpu, const RaySource& source) : rays_(gpu, source.count, Access::Storage, "rays") {
    std::vector<Ray> rays(source.count);
    source.read(0, rays);
    rays_.upload(rays);
    there_.emplace(DeviceRays{rays_, source.count});
    const FilterWords words = source.filters.read(0, source.count);
    for (std::size_t f = 0; f < FILTERS; ++f) {
      if (words.of[f].empty()) continue;
      words_[f].emplace(gpu, source.count, Access::Storage, "words").upload(words.of[f]);
      there_->filters.of[f] = &*words_[f];
    }
  }
  const DeviceRays& rays() const { return *there_; }

 private:
  Buffer<Ray> rays_;
  std::array<std::optional<Buffer<std::uint32_t>>, FILTERS> words_;
  std::optional<DeviceRays> there_;
};

/// Arrays for lists, filled with a pattern.
template <class Record>
struct ArraysThere {
  ArraysThere(Context& gpu, std::size_t questions, std::size_t room)
      : counts(gpu, questions, Access::Storage, "counts"),
        offsets(gpu, questions + 1, Access::Storage, "offsets"),
        records(gpu, room, Access::Storage, "records") {
    for (RawBuffer* b : std::initializer_list<RawBuffer*>{&counts, &offsets, &records}) {
      const std::vector<std::byte> pattern(std::size_t(b->bytes()), std::byte{0x5A});
      b->upload(0, pattern.data(), pattern.size());
    }
  }
  DeviceLists<Record> lists() { return {counts, &offsets, &records}; }

  /// Expects counts and offsets, and the first records; behind them the pattern.
  void expect(std::span<const std::uint32_t> numbers, std::span<const std::int64_t> begins,
              std::span<const Record> first) const {
    EXPECT_TRUE(begins_with(counts, numbers));
    EXPECT_TRUE(begins_with(offsets, begins));
    EXPECT_TRUE(begins_with(records, first));
    std::vector<std::byte> behind(std::size_t(records.bytes()) - first.size_bytes());
    records.RawBuffer::download(first.size_bytes(), behind.data(), behind.size());
    EXPECT_EQ(std::ranges::count(behind, std::byte{0x5A}), std::ssize(behind));
  }

  Buffer<std::uint32_t> counts;
  Buffer<std::int64_t> offsets;
  Buffer<Record> records;

 private:
  template <class T>
  static bool begins_with(const Buffer<T>& buffer, std::span<const T> truth) {
    std::vector<T> found(truth.size());
    buffer.download(found);
    for (std::size_t i = 0; i < truth.size(); ++i)
      if (std::memcmp(&found[i], &truth[i], sizeof(T)) != 0) {
        ADD_FAILURE() << buffer.name() << ": number " << i << " of " << truth.size() << " differs";
        return false;
      }
    return true;
  }
};

}  // namespace ballot
