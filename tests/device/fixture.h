// What every device test stands on: the driver that the run names, validation on and silent.
#pragma once

#include <gtest/gtest.h>

#include "tests/device/harness.h"

namespace ballot {

/// Asserts, when the test ends, that the validation layers said nothing.
class DeviceTest : public testing::Test {
 protected:
  static ContextOptions options() { return {.device = "", .validate = true}; }

  /// A scene of these triangles on the device, with the oracle of the uploaded arrays.
  struct Traced {
    std::vector<Triangle> triangles;
    Bvh bvh;
    std::unique_ptr<Tracer> tracer;
    std::unique_ptr<Oracle> oracle;
  };
  static std::unique_ptr<Traced> make(Context& gpu, std::vector<Triangle> triangles,
                                      const BuildSettings& settings = {}) {
    auto t = std::make_unique<Traced>();
    t->triangles = std::move(triangles);
    t->bvh = build_bvh(t->triangles, settings);
    EXPECT_EQ(check_bvh(t->bvh, t->triangles, settings), std::vector<std::string>{});
    t->tracer = std::make_unique<Tracer>(gpu, t->bvh, t->triangles, facts_of(t->bvh));
    t->tracer->prefill = harness::kPattern;
    t->oracle = std::make_unique<Oracle>(t->tracer->pair_tree(NodeLayout::Interleaved));
    return t;
  }

  static void expect_silent(const Context& gpu) { EXPECT_EQ(gpu.messages(), std::vector<std::string>{}); }
};

}  // namespace ballot
