// Runs the hard cases of coordinates in double at their small size: mode double finds what tests of every triangle in
// long double find, and lies where they do to within doubles.
#include "tests/device/fixture.h"
#include "tools/verify/doubles.h"

namespace ballot {

std::ostream& operator<<(std::ostream& out, const HardDoubleCase& hard) { return out << hard.name; }

namespace {

class HardDoubleCases : public DeviceTest, public testing::WithParamInterface<HardDoubleCase> {};

TEST_P(HardDoubleCases, HoldInDouble) {
  if (!gpu_->info().float64) GTEST_SKIP() << "the device lacks float64";
  DeviceSceneOptions options;
  options.context = gpu_;
  verify::DoubleCase hard(GetParam(), options, true);
  const verify::DoubleRecord before = hard.answer_rounded(), found = hard.answer("double");
  EXPECT_EQ(found.rays, 501u);
  EXPECT_EQ(found.other_hits + found.other_prims, 0u);
  EXPECT_EQ(found.unlike, 0u);
  EXPECT_LT(found.most, 1e-5);  // from 1e9 away a double has places of 1.2e-7
  EXPECT_GT(before.most, 100 * found.most);
  EXPECT_GT(before.other_hits + before.other_prims, 0u);
}

INSTANTIATE_TEST_SUITE_P(Hard, HardDoubleCases,
                         testing::ValuesIn(hard_double_cases().begin(), hard_double_cases().end()), [](const auto& p) {
                           std::string name(p.param.name);
                           std::ranges::replace(name, '-', '_');
                           return name;
                         });

}  // namespace
}  // namespace ballot
