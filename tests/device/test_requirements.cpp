// Tests that devices which lack a feature are refused, with a reason for each lack. These tests need no device.
#include <gtest/gtest.h>

#include "engine/answer/numeric.h"
#include "engine/core/error.h"
#include "engine/gpu/device.h"

namespace ballot {
namespace {

/// The properties and features that a device reports.
struct Reported {
  DeviceProperties properties;
  DeviceFeatures features;
};

/// Returns a device that has just what Ballot needs.
Reported sufficient() {
  Reported m;
  m.properties.core.properties.apiVersion = VK_API_VERSION_1_2;
  m.properties.v11.subgroupSize = 32;
  m.properties.v11.subgroupSupportedStages = VK_SHADER_STAGE_COMPUTE_BIT;
  m.properties.v11.subgroupSupportedOperations =
      VK_SUBGROUP_FEATURE_BASIC_BIT | VK_SUBGROUP_FEATURE_VOTE_BIT | VK_SUBGROUP_FEATURE_BALLOT_BIT;
  m.features.v12.scalarBlockLayout = VK_TRUE;
  return m;
}

std::vector<std::string> refusals(const Reported& m) { return refusals_of(m.properties, m.features); }

TEST(Requirements, ASufficientDeviceIsTaken) { EXPECT_TRUE(refusals(sufficient()).empty()); }

TEST(Requirements, AnOldVersionIsRefused) {
  Reported m = sufficient();
  m.properties.core.properties.apiVersion = VK_API_VERSION_1_1;
  EXPECT_EQ(refusals(m), std::vector<std::string>{"it offers Vulkan 1.1, Ballot needs 1.2"});
}

TEST(Requirements, EveryLackIsListedWithItsReason) {
  Reported m = sufficient();
  m.features.v12.scalarBlockLayout = VK_FALSE;
  m.properties.v11.subgroupSupportedOperations &= ~std::uint32_t(VK_SUBGROUP_FEATURE_BALLOT_BIT);
  m.properties.v11.subgroupSize = 1;
  const auto all = refusals(m);
  ASSERT_EQ(all.size(), 3u);
  EXPECT_EQ(all[0], "it lacks scalarBlockLayout (shaders/shared/layout.h packs records without padding)");
  EXPECT_EQ(all[1],
            "it lacks subgroup operations basic, vote and ballot in compute (the lanes of a subgroup vote on their way "
            "through the tree)");
  EXPECT_EQ(all[2], "it lacks a subgroup of 4 to 128 lanes (packets and votes are sized for these)");
}

TEST(Requirements, VotesMustWorkInCompute) {
  Reported m = sufficient();
  m.properties.v11.subgroupSupportedStages = VK_SHADER_STAGE_FRAGMENT_BIT;
  EXPECT_EQ(refusals(m).size(), 1u);
}

// To compile these modes for a device without float64 is no error; to trace with them is one.
TEST(Requirements, ModesInFloat64NeedIt) {
  DeviceInfo device;
  device.name = "a device";
  EXPECT_EQ(find_numeric("watertight", device).name, "watertight");
  for (const char* mode : {"exact", "double"}) {
    device.float64 = false;
    try {
      find_numeric(mode, device);
      ADD_FAILURE() << "mode " << mode << " was accepted without float64, expected an error";
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), Failure::Arguments);
      EXPECT_EQ(std::string(e.what()),
                "numeric mode " + std::string(mode) +
                    " needs double precision (shaderFloat64), which a device lacks; modes without it: fast, plain, "
                    "watertight");
    }
    device.float64 = true;
    EXPECT_EQ(find_numeric(mode, device).name, mode);
  }
}

}  // namespace
}  // namespace ballot
