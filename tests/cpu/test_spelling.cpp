// Tests the suggestions for words that are spelt wrong.
#include <gtest/gtest.h>

#include <array>

#include "engine/core/spelling.h"

namespace ballot {
namespace {

TEST(Spelling, DistanceCountsLetters) {
  EXPECT_EQ(edit_distance("", ""), 0u);
  EXPECT_EQ(edit_distance("abc", ""), 3u);
  EXPECT_EQ(edit_distance("packet", "pakcet"), 1u);
  EXPECT_EQ(edit_distance("packet", "packets"), 1u);
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3u);
}

TEST(Spelling, NearNamesAreSuggested) {
  constexpr std::array<std::string_view, 3> kNames{"while-while", "packet", "packet-wide"};
  EXPECT_EQ(did_you_mean("pakcet", kNames), " (did you mean 'packet'?)");
  EXPECT_EQ(did_you_mean("while_while", kNames), " (did you mean 'while-while'?)");
  EXPECT_EQ(did_you_mean("glossy", kNames), "");
  EXPECT_EQ(did_you_mean("", kNames), "");
  EXPECT_EQ(did_you_mean(std::string(100, 'x'), kNames), "");
}

}  // namespace
}  // namespace ballot
