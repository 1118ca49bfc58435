// A parallel radix sort of keys on the host.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "engine/core/parallel.h"

namespace ballot {

/// A key and the place where it stood.
struct PlacedKey {
  std::uint32_t key, place;
};

/// Sorts keys by their lowest `bits` bits, 1 to 32. Equal keys keep their order. `room` is as large as `keys`; what it
/// holds afterwards is unspecified.
///
/// A least significant digit radix sort: each digit is counted in every chunk of keys, and each chunk then moves its
/// own keys. Source: Marco Zagha, Guy Blelloch. Radix Sort for Vector Multiprocessors. Supercomputing 1991.
void sort_keys(std::vector<PlacedKey>& keys, std::vector<PlacedKey>& room, int bits);

/// Writes the order of the places of keys of up to kCountedBits bits to `order`: its entry k is the place of the key
/// that comes at place k. Equal keys keep their order. A counting sort: one pass, in which the places alone move.
void order_by_counting(std::span<const std::uint32_t> keys, int bits, std::vector<std::uint32_t>& order);
constexpr int kCountedBits = 18;  // a megabyte of counters for each core

/// Returns the order of numbers 0 to count - 1 by key_of(number), in `order`: its entry k is the number at place k.
/// key_of must be thread-safe.
template <class KeyOf>
void order_by(std::size_t count, const KeyOf& key_of, int bits, std::vector<std::uint32_t>& order) {
  constexpr std::size_t kChunk = 1 << 14;
  if (bits <= kCountedBits) {
    std::vector<std::uint32_t> keys(count);
    for_chunks(count, kChunk, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) keys[i] = key_of(i);
    });
    return order_by_counting(keys, bits, order);
  }
  std::vector<PlacedKey> keys(count), room(count);
  for_chunks(count, kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) keys[i] = {key_of(i), std::uint32_t(i)};
  });
  sort_keys(keys, room, bits);
  order.resize(count);
  for_chunks(count, kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) order[i] = keys[i].place;
  });
}

}  // namespace ballot
