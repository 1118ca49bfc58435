// The fixture of the tests of builders and refits. They share a device, as lavapipe takes long to compile the builder.
#pragma once

#include "engine/tree/device/device_build.h"
#include "tests/device/fixture.h"
#include "tests/device/tree_shapes.h"

namespace ballot {

class Builders : public DeviceTest {
 protected:
  static Bvh build(std::span<const Triangle> triangles, BuildSettings settings, const Builder& builder) {
    settings.builder = builder.id;
    return builder.on_device ? build_bvh_on_device(*gpu_, triangles, settings) : build_bvh(triangles, settings);
  }
  static Bvh sound(std::span<const Triangle> triangles, const BuildSettings& settings, const Builder& builder) {
    Bvh bvh = build(triangles, settings, builder);
    EXPECT_EQ(check_bvh(bvh, triangles, settings), std::vector<std::string>{}) << builder.name;
    EXPECT_EQ(bvh.stats.builder, builder.id);
    return bvh;
  }
  static const Builder& device() { return builder_of(BuilderId::Device); }
};

}  // namespace ballot
