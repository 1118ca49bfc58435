// Tests of --instances: the commands work on scenes that keep their meshes once.
#include "engine/files/image.h"
#include "tests/cli/cli.h"
#include "tests/cpu/animated.h"

namespace ballot::test {
namespace {

class InstancesCli : public Cli {
 protected:
  /// Writes row.glb: a triangle in the plane z = 0 that three nodes place, one of them mirrored, and a camera.
  void SetUp() override {
    AnimatedBuilder b = moving_triangle();
    b.node({{"mesh", 0}, {"translation", {1.5, 0, 0}}});
    b.node({{"mesh", 0}, {"translation", {-0.5, 0, 0}}, {"scale", {-1, 1, 1}}});
    b.json["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", 0.9}, {"znear", 0.1}}}}};
    b.node({{"name", "front"}, {"camera", 0}, {"translation", {0.3, 0.3, 4}}});
    write("row.glb", b.glb());
  }
};

TEST_F(InstancesCli, CommandsTakeThem) {
  const Result info =
      succeed({"info", "row.glb", "--instances", "keep", "--triangles", "kept.npy", "--json", "i.json"});
  expect_parts(info.out, {"scene row: 3 triangles", "3 instances of 2 meshes, which are kept once: 2 triangles",
                          "; 1 triangles move", "wrote 3 triangles"});
  expect_parts(info.out, {"2 meshes:\n", "3 instances:\n", "(-1.5, 0, 0) to (-0.5, 1, 0)"});
  EXPECT_EQ(json("i.json")["meshes"].size(), 2u);
  EXPECT_EQ(json("i.json")["instances"].size(), 3u);
  rays(256);
  for (const char* policy : {"keep", "copy"}) {
    succeed(
        {"trace", "row.glb", "--instances", policy, "--rays", "rays.npy", "--out", std::string(policy) + ".hits.npy"});
    succeed({"render", "row.glb", "--instances", policy, "--size", "32x32", "--out", std::string(policy) + ".exr"});
  }
  const auto kept = hits("keep.hits.npy"), copied = hits("copy.hits.npy");
  ASSERT_EQ(kept.size(), copied.size());
  for (std::size_t i = 0; i < kept.size(); ++i) EXPECT_EQ(kept[i].prim, copied[i].prim) << i;
  for (const char* policy : {"keep", "copy"})
    succeed({"trace", "row.glb", "--instances", policy, "--rays", "rays.npy", "--out", std::string(policy) + ".npy",
             "--count"});
  EXPECT_EQ(read("keep.npy"), read("copy.npy"));
  EXPECT_EQ(read_exr(path("keep.exr")).channel("prim").uints, read_exr(path("copy.exr")).channel("prim").uints);
  succeed({"render", "row.glb", "--instances", "keep", "--size", "16x16", "--time", "1.5", "--out", "late.exr"});
  const Result verify = succeed({"verify", "row.glb", "--instances", "keep", "--size", "16x16", "--methods", "if-if",
                                 "--rays", "primary,shadow", "--numeric", "exact"});
  expect_parts(verify.out, {"none of"});
  succeed({"bench", "row.glb", "--instances", "keep", "--size", "16x16", "--repeat", "1", "--methods",
           "while-while,bvh4", "--rays", "primary,ao"});
}

TEST_F(InstancesCli, WhatTakesNoneIsLoadedWithCopies) {
  rays(16);
  EXPECT_EQ(run({"check", "row.glb"}).code, 1);  // not closed
  refuse(2, {"no policy of --instances is called 'kept'", "auto, keep, copy"},
         {"info", "row.glb", "--instances", "kept"});
  refuse(2, {"method packet-wide: it has no kernel for scenes with instances"},
         {"render", "row.glb", "--instances", "keep", "--method", "packet-wide", "--out", "x.exr"});
}

}  // namespace
}  // namespace ballot::test
