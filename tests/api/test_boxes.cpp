// Triangles that overlap boxes, as a program sees them.
#include <limits>

#include "api.h"

namespace {

class Boxes : public Api {
 protected:
  const std::vector<float> positions_{0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};
  const std::vector<std::uint32_t> indices_{0, 1, 2, 1, 3, 2};
  const ballot::Scene scene_{*device_, {ballot::mesh(positions_, indices_)}};
};

TEST_F(Boxes, Overlapping) {
  constexpr float kFar = std::numeric_limits<float>::infinity();
  const std::vector<float> low{0, 0, 0, 0.75f, 0.75f, -1, -kFar, -kFar, -kFar, 1, 0, 0};
  const std::vector<float> high{0.25f, 0.25f, 0, 2, 2, 2, kFar, kFar, kFar, 0, 1, 1};
  const ballot::Lists found = scene_.overlapping({.low = low, .high = high});
  EXPECT_EQ(found.counts, (std::vector<std::int64_t>{1, 1, 2, 0}));
  EXPECT_EQ(found.offsets, (std::vector<std::int64_t>{0, 1, 2, 4, 4}));
  const std::uint32_t prims[] = {0, 1, 0, 1};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(found.hits[i].prim, prims[i]);
    EXPECT_EQ(found.hits[i].t, 0);
  }
  EXPECT_EQ(scene_.count_overlapping({.low = low, .high = high}), found.counts);
  const std::uint32_t excluded[] = {0, 1, 1, 1};
  EXPECT_EQ(scene_.count_overlapping({.low = low, .high = high, .excluded = excluded}),
            (std::vector<std::int64_t>{0, 0, 1, 0}));
}

TEST_F(Boxes, AreRefusedWithWhatIsMissing) {
  const std::vector<float> corners{0, 0, 0};
  EXPECT_THROW(scene_.overlapping({.low = corners}), ballot::Error);
  EXPECT_THROW(scene_.overlapping({.low = corners, .high = corners}, {.numeric = "exact"}), ballot::Error);
  EXPECT_THROW(scene_.overlapping({.low = corners, .high = corners}, {.first = 1}), ballot::Error);
  const BallotBoxes boxes = ballot_boxes(corners.data(), 0);
  BallotLists to;
  EXPECT_EQ(ballot_list_overlapping(scene_.handle(), &boxes, nullptr, nullptr, nullptr), BALLOT_ERROR_ARGUMENT);
  EXPECT_EQ(ballot_list_overlapping(scene_.handle(), nullptr, &to, nullptr, nullptr), BALLOT_ERROR_ARGUMENT);
}

}  // namespace
