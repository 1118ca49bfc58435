// The fixture of the device tests: the default device of the driver that main.cpp has chosen, with validation layers
// that must report nothing.
#pragma once

#include <gtest/gtest.h>

#include "tests/device/harness.h"

namespace ballot {

/// A fixture for tests that trace triangles and hold the hits to the oracle. A test ends with expect_silent().
class DeviceTest : public testing::Test {
 protected:
  /// Options for the default device, with validation.
  static ContextOptions options() { return {.device = "", .validate = true}; }

  /// Triangles, their tree, a tracer that holds both on the device, and the oracle over the uploaded arrays.
  struct Traced {
    std::vector<Triangle> triangles;
    Bvh bvh;
    std::unique_ptr<Tracer> tracer;
    std::unique_ptr<Oracle> oracle;
  };
  /// Builds the tree, expects that check_bvh() finds no fault in it, and uploads it.
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

  /// Expects that the validation layers have reported nothing so far.
  static void expect_silent(const Context& gpu) { EXPECT_EQ(gpu.messages(), std::vector<std::string>{}); }
};

}  // namespace ballot
