// Tests the parallel radix sort against std::stable_sort.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "engine/core/key_sort.h"

namespace ballot {
namespace {

TEST(KeySort, OrdersAsAStableSortDoes) {
  std::mt19937 random(5);
  for (const std::size_t count : {0u, 1u, 2u, 3u, 1000u, 70'001u})
    for (const int bits : {1, 12, 18, 19, 24, 30, 32})
      for (const std::uint32_t most : {3u, 0xFFFFFFFFu}) {
        std::vector<std::uint32_t> keys(count), order;
        for (std::uint32_t& k : keys) k = std::uint32_t(random()) & most & std::uint32_t((1ull << bits) - 1);
        order_by(
            count, [&](std::size_t i) { return keys[i]; }, bits, order);
        std::vector<std::uint32_t> expected(count);
        for (std::uint32_t i = 0; i < count; ++i) expected[i] = i;
        std::ranges::stable_sort(expected, {}, [&](std::uint32_t i) { return keys[i]; });
        EXPECT_EQ(order, expected) << count << " keys of " << bits << " bits";
      }
}

}  // namespace
}  // namespace ballot
