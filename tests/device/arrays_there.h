// Arrays on the device that tests of lists ask and are answered by.
#pragma once

#include <gtest/gtest.h>

#include <cstring>

#include "engine/answer/ray_queries.h"

namespace ballot {

/// The rays of a source, and their masks, on the device.
class RaysThere {
 public:
  RaysThere(Context& gpu, const RaySource& source)
      : rays_(gpu, source.count, Access::Storage, "rays"), masks_(gpu, source.count, Access::Storage, "masks") {
    std::vector<Ray> rays(source.count);
    source.read(0, rays);
    rays_.upload(rays);
    std::vector<std::uint32_t> masks(source.masks ? source.count : 0);
    if (source.masks) source.masks(0, masks);
    masks_.upload(masks);
    there_.emplace(DeviceRays{rays_, source.count, source.masks ? &masks_ : nullptr});
  }
  const DeviceRays& rays() const { return *there_; }

 private:
  Buffer<Ray> rays_;
  Buffer<std::uint32_t> masks_;
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
