// The fixture of the device tests: the default device, with validation layers that must report nothing.
#pragma once

#include <gtest/gtest.h>

#include "tests/device/harness.h"

namespace ballot {

/// A fixture for tests that trace triangles and hold the hits to the oracle. The tests of a suite share a device, so
/// that it compiles each kernel once.
class DeviceTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    gpu_ = std::make_shared<Context>(options());
    gpu_->set_answers_few(false);  // kernels are tested by few questions, too
  }
  static void TearDownTestSuite() { gpu_.reset(); }
  void TearDown() override {
    if (gpu_) expect_silent(*gpu_);
  }
  static inline std::shared_ptr<Context> gpu_;

  /// Options for the default device, with validation.
  static ContextOptions options() { return {.device = "", .validate = true}; }

  /// Triangles, their tree, a tracer that holds both on the device, and the oracle over the uploaded arrays.
  struct Traced {
    UnsetVector<Triangle> triangles;
    Bvh bvh;
    std::unique_ptr<Tracer> tracer;
    std::unique_ptr<Oracle> oracle;
  };
  /// What kernels are compiled for: for any tree of up to 31 levels, so that they serve most scenes of a test, or for
  /// this tree alone.
  enum class Facts { OfMostTrees, OfThisTree };
  static TreeFacts facts_for(const Bvh& bvh, Facts facts) {
    TreeFacts own = facts_of(bvh);
    if (facts == Facts::OfMostTrees) own.depth = std::max(own.depth, 31u), own.largest_leaf = MAX_LEAF_TRIANGLES;
    return own;
  }
  /// Builds the tree, expects that check_bvh() finds no fault in it, and uploads it.
  static std::unique_ptr<Traced> make(Context& gpu, UnsetVector<Triangle> triangles, const BuildSettings& settings = {},
                                      Facts facts = Facts::OfMostTrees) {
    auto t = std::make_unique<Traced>();
    t->triangles = std::move(triangles);
    t->bvh = build_bvh(t->triangles, settings);
    EXPECT_EQ(check_bvh(t->bvh, t->triangles, settings), std::vector<std::string>{});
    t->tracer = std::make_unique<Tracer>(gpu, t->bvh, t->triangles, facts_for(t->bvh, facts));
    t->tracer->prefill = harness::kPattern;
    t->oracle = std::make_unique<Oracle>(t->tracer->pair_tree(NodeLayout::Interleaved));
    return t;
  }

  /// Expects that the validation layers have reported nothing so far.
  static void expect_silent(const Context& gpu) { EXPECT_EQ(gpu.messages(), std::vector<std::string>{}); }
};

}  // namespace ballot
