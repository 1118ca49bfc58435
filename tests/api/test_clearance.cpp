// Distances of scenes, as a program sees them.
#include <cmath>

#include "api.h"

namespace {

class Clearances : public Api {
 protected:
  static ballot::Mesh at(const std::vector<float>& positions, const std::vector<std::uint32_t>& indices) {
    return ballot::mesh(positions, indices);
  }
  const std::vector<float> positions_{0, 0, 0, 1, 0, 0, 0, 1, 0};
  const std::vector<std::uint32_t> indices_{0, 1, 2};
  const ballot::Scene scene_{*device_, {at(positions_, indices_)}};
  const ballot::Scene other_{*device_, {at(positions_, indices_)}};
};

TEST_F(Clearances, OfPoses) {
  const double above[] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 3};
  const std::vector<float> poses{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 5, 0, 1, 0, 0, 0, 0, 1, 0};
  double distances[2] = {-1, -1}, points[6], other_points[6];
  std::uint32_t prims[2], other_prims[2];
  const ballot::Times times = scene_.clearance(other_,
                                               {.distances = distances,
                                                .prims = prims,
                                                .other_prims = other_prims,
                                                .points = points,
                                                .other_points = other_points},
                                               {.pose = poses});
  EXPECT_EQ(times.hits, 2u);
  EXPECT_EQ(distances[0], 0);
  EXPECT_EQ(distances[1], 4);
  EXPECT_EQ(prims[1], 0u);
  EXPECT_EQ(other_prims[1], 0u);
  EXPECT_EQ(points[3], 1);
  EXPECT_EQ(other_points[3], 5);
  const ballot::Times near = scene_.clearance(other_, {.distances = distances, .prims = prims},
                                              {.pose = ballot::Column(above, {0}), .limit = 2, .shape = {1}});
  EXPECT_EQ(near.hits, 0u);
  EXPECT_TRUE(std::isinf(distances[0]));
  EXPECT_EQ(prims[0], BALLOT_MISS);
  distances[0] = -1;
  scene_.clearance(other_, {.distances = distances});
  EXPECT_EQ(distances[0], 0);
  distances[0] = -1;
  BallotClearance to;
  to.distances = distances;
  EXPECT_EQ(ballot_clearance(scene_.handle(), other_.handle(), nullptr, &to, nullptr, nullptr), BALLOT_OK);
  EXPECT_EQ(distances[0], 0);
}

TEST_F(Clearances, AreRefusedWithWhatIsWrong) {
  double distance;
  BallotClearance to;
  to.distances = &distance;
  EXPECT_EQ(ballot_clearance(scene_.handle(), nullptr, nullptr, &to, nullptr, nullptr), BALLOT_ERROR_ARGUMENT);
  EXPECT_EQ(ballot_clearance(scene_.handle(), other_.handle(), nullptr, nullptr, nullptr, nullptr),
            BALLOT_ERROR_ARGUMENT);
  EXPECT_THROW(scene_.clearance(other_, to, {.limit = -1}), ballot::Error);
  EXPECT_THROW(scene_.clearance(other_, to, {.limit = NAN}), ballot::Error);
  const std::vector<float> pose{1, 0, 0, NAN, 0, 1, 0, 0, 0, 0, 1, 0};
  EXPECT_THROW(scene_.clearance(other_, to, {.pose = pose}), ballot::Error);
  EXPECT_THROW(scene_.clearance(other_, to, {}, {.numeric = "exact"}), ballot::Error);
}

}  // namespace
