// Lists of arrays that stay on the device: where they go.
#pragma once

#include <cstdint>

#include "engine/answer/dispatch.h"

namespace ballot {

/// Where the lists of `n` questions go, on the device.
template <class Record>
struct DeviceLists {
  Buffer<std::uint32_t>& counts;            // n: the length of each list
  Buffer<std::int64_t>* offsets = nullptr;  // n + 1: where each list begins among all, then their sum; null: not wanted
  /// The lists, one after the other. If there is room for fewer than all, those that fit are whole and in their places,
  /// and what lies behind them is unspecified. Null: they are only counted.
  Buffer<Record>* records = nullptr;
};

/// What a call found.
struct DeviceListed {
  TraceTimes times;
  std::uint64_t records = 0;  // of all lists, whatever the room
};

}  // namespace ballot
