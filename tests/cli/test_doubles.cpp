// Tests of arrays in double, in and out of `trace` and `distance`.
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include "tests/cli/cli.h"

namespace ballot::test {
namespace {

class FilesInDouble : public Cli {};

TEST_F(FilesInDouble, ArraysInDoubleFarFromZero) {
  constexpr double kEast = 500000.3, kNorth = 5e6 + 0.2;
  array<double>("far.npy", {kEast, kNorth, 0, kEast + 2, kNorth, 0, kEast, kNorth + 2, 0}, 9);
  array<double>("points.npy", {kEast + 0.25, kNorth + 0.5, 1.5, kEast - 3, kNorth, 0}, 3);
  array<double>("rays.npy", {kEast + 0.25, kNorth + 0.5, 6e7, 0, 0, -1, kEast + 0.25, kNorth + 0.5, 3, 0, 0, -1}, 6);
  succeed({"distance", "far.npy", "--points", "points.npy", "--out", "d.npy"});
  const auto distances = items<float>("d.npy", "'<f4'");
  ASSERT_EQ(distances.size(), 2u);
  EXPECT_NEAR(distances[0], 1.5, 1e-6);
  EXPECT_NEAR(distances[1], 3, 1e-6);
  succeed({"trace", "far.npy", "--rays", "rays.npy", "--out", "h.npy"});
  const auto found = hits("h.npy");
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].t, 6e7f);
  EXPECT_NEAR(found[0].u, 0.125, 1e-6);
  EXPECT_NEAR(found[1].t, 3, 1e-6);
  succeed({"trace", "far.npy", "--rays", "rays.npy", "--out", "c.npy", "--all"});
  EXPECT_EQ(items<float>("c.npy", "'ray'")[1], 6e7f);
  succeed({"trace", "far.npy", "--rays", "rays.npy", "--out", "n.npy", "--count"});
  EXPECT_EQ(items<std::uint32_t>("n.npy", "'<u4'"), (std::vector<std::uint32_t>{1, 1}));
  expect_parts(succeed({"info", "far.npy"}).out, {"counted from the origin (500001"});
}

TEST_F(FilesInDouble, AnswersInDouble) {
  array<double>("far.npy", {5e5, 5e6, 0, 5e5 + 2, 5e6, 0, 5e5, 5e6 + 2, 0}, 9);
  array<double>("points.npy", {5e5 - 3, 5e6, 4.0000000001}, 3);
  array<double>("rays.npy", {5e5, 5e6, 6e7 + 0.25, 0, 0, -1, 5e5 - 9, 5e6, 1, 0, 0, -1}, 6);
  succeed({"distance", "far.npy", "--points", "points.npy", "--out", "d.npy", "--distances-double"});
  EXPECT_NEAR(items<double>("d.npy", "'<f8'").at(0), std::hypot(3, 4.0000000001), 1e-14);
  refuse(2, {"--distances-double", "--grid"},
         {"distance", "far.npy", "--grid", "9", "--distances-double", "--out", "f.npy"});
  for (const char* numeric : {"watertight", "double"}) {
    succeed({"trace", "far.npy", "--rays", "rays.npy", "--out", "h.npy", "--t-double", "--numeric", numeric});
    const auto bytes =
        items<std::array<char, 20>>("h.npy", "[('t', '<f8'), ('prim', '<u4'), ('u', '<f4'), ('v', '<f4')]");
    double t[2];
    for (std::size_t i = 0; i < 2; ++i) std::memcpy(&t[i], bytes.at(i).data(), sizeof t[i]);
    EXPECT_EQ(t[0], 6e7 + 0.25);
    EXPECT_EQ(t[1], std::numeric_limits<double>::infinity());
  }
  refuse(2, {"--t-double"}, {"trace", "far.npy", "--rays", "rays.npy", "--out", "n.npy", "--t-double", "--count"});
}

}  // namespace
}  // namespace ballot::test
