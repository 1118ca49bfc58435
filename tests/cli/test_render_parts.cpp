// Tests of pictures that are rendered in parts: tiles and their merging, crops, checkpoints and resuming from them.
// Also tests the error figures against a reference picture.
#include "engine/files/image.h"
#include "tests/cli/cli.h"
#include "tests/cpu/gltf_builder.h"

namespace ballot::test {
namespace {

class Parts : public Cli {
 protected:
  /// Writes scene.glb: a lamp over a floor, small enough to render quickly.
  void SetUp() override {
    GltfBuilder b;
    b.mesh(b.vec3({-2, 0, -2, -2, 0, 2, 2, 0, 2, -2, 0, -2, 2, 0, 2, 2, 0, -2}));
    b.mesh(b.vec3({-1, 2, -1, 1, 2, -1, 1, 2, 1}));
    b.json["materials"] = {{{"name", "floor"}, {"pbrMetallicRoughness", {{"metallicFactor", 0}}}},
                           {{"name", "lamp"}, {"emissiveFactor", {1, 0.5, 0.25}}}};
    b.primitive(0)["material"] = 0;
    b.primitive(1)["material"] = 1;
    b.node({{"mesh", 0}});
    b.node({{"mesh", 1}});
    b.json["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", 0.9}, {"znear", 0.1}}}}};
    b.node({{"name", "view"}, {"camera", 0}, {"translation", {0, 1, 5}}});
    write("scene.glb", b.glb());
  }

  Words render(const std::string& out, const Words& more) const {
    Words words{"render", "scene.glb", "--shading", "path", "--out", out, "--aov", "color,depth,prim,samples,variance"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }

  Image picture(const std::string& name) const { return read_exr(path(name)); }

  static void expect_same(const Image& a, const Image& b) {
    ASSERT_EQ(a.channels.size(), b.channels.size());
    for (std::size_t c = 0; c < a.channels.size(); ++c) {
      EXPECT_EQ(a.channels[c].name, b.channels[c].name);
      EXPECT_EQ(a.channels[c].floats, b.channels[c].floats) << a.channels[c].name;
      EXPECT_EQ(a.channels[c].uints, b.channels[c].uints) << a.channels[c].name;
    }
  }
};

TEST_F(Parts, TilesMergeToThePictureOfOneRun) {
  succeed(render("whole.exr", {"--size", "80x40", "--spp", "5"}));
  for (const char* part : {"2", "0", "1"})
    succeed(render(std::string("part") + part + ".exr",
                   {"--size", "80x40", "--spp", "5", "--tiles", std::string(part) + "/3"}));
  succeed({"merge", "part2.exr", "part0.exr", "part1.exr", "--out", "merged.exr"});
  const Image whole = picture("whole.exr"), merged = picture("merged.exr");
  expect_same(whole, merged);
  EXPECT_EQ(merged.attributes.size(), whole.attributes.size());
  EXPECT_FALSE(merged.attributes.contains("part"));
  refuse(2, {"part 1/3 is missing", "--tiles 1/3"}, {"merge", "part0.exr", "part2.exr", "--out", "m.exr"});
  refuse(2, {"there twice"}, {"merge", "part0.exr", "part0.exr", "part1.exr", "--out", "m.exr"});
  refuse(1, {"whole.exr", "no attribute part"}, {"merge", "whole.exr", "--out", "m.exr"});
}

TEST_F(Parts, ACropHasThePixelsOfTheWhole) {
  succeed(render("whole.exr", {"--size", "40x30", "--spp", "3"}));
  succeed(render("crop.exr", {"--size", "40x30", "--spp", "3", "--crop", "5,7,38,20"}));
  const Image whole = picture("whole.exr"), crop = picture("crop.exr");
  EXPECT_EQ(crop.width, 33u);
  EXPECT_EQ(crop.height, 13u);
  EXPECT_EQ(crop.x, 5u);
  EXPECT_EQ(crop.full_width, 40u);
  for (const char* name : {"R", "Z", "variance.G"})
    for (std::uint32_t y = 0; y < crop.height; ++y)
      for (std::uint32_t x = 0; x < crop.width; ++x)
        EXPECT_EQ(crop.channel(name).floats[y * crop.width + x], whole.channel(name).floats[(y + 7) * 40 + x + 5]);
  EXPECT_EQ(whole.channel("samples").uints[17], 3u);
  refuse(2, {"crop: ", "40x30"}, render("x.exr", {"--size", "40x30", "--crop", "5,7,41,20"}));
  refuse(2, {"--crop 5,7", "X0,Y0,X1,Y1"}, render("x.exr", {"--crop", "5,7"}));
  refuse(2, {"tiles: ", "3 of 3"}, render("x.exr", {"--tiles", "3/3"}));
  refuse(2, {"--png", "name color"}, {"render", "scene.glb", "--out", "x.exr", "--aov", "depth", "--png"});
  refuse(2, {"no AOV is called 'depht'", "depth"}, render("x.exr", {"--aov", "depht"}));
}

// A run that was killed without warning resumes from the last checkpoint. Its picture equals, bit for bit, that of a
// run that was not killed.
TEST_F(Parts, KilledAndResumed) {
  const Words size{"--size", "24x24", "--spp", "3000", "--checkpoint", "0.01"};
  succeed(render("single.exr", size));
  EXPECT_FALSE(std::filesystem::exists(path("single.checkpoint.exr")));
  kill_when_there_is("killed.checkpoint.exr", render("killed.exr", size));
  EXPECT_FALSE(std::filesystem::exists(path("killed.exr")));
  Words other = render("killed.exr", {"--size", "24x24", "--spp", "3001", "--resume"});
  const Result refused = run(other);
  EXPECT_EQ(refused.code, 1);
  expect_parts(refused.err, {"killed.checkpoint.exr", "spp: 3000", "spp: 3001", "remove it"});
  Words again = render("killed.exr", size);
  again.push_back("--resume");
  expect_parts(succeed(again).out, {"resumed from"});
  expect_same(picture("single.exr"), picture("killed.exr"));
  EXPECT_FALSE(std::filesystem::exists(path("killed.checkpoint.exr")));
}

TEST_F(Parts, ErrorsToAReferenceFall) {
  succeed(render("reference.exr", {"--size", "16x16", "--spp", "400"}));
  const Result result =
      succeed(render("picture.exr", {"--size", "16x16", "--spp", "64", "--seed", "9", "--reference", "reference.exr"}));
  expect_parts(result.out, {"RMSE", "relMSE", "FLIP", "picture.errors.json"});
  const auto records = json("picture.errors.json").at("records");
  EXPECT_EQ(records.size(), 7u);  // 1, 2, 4, ... 64 samples
  for (const char* measure : {"rmse", "relmse", "flip"})
    EXPECT_LT(records.back().at(measure), 0.6 * double(records.front().at(measure))) << measure;
  refuse(2, {"reference.exr", "16 x 16", "20 x 16"},
         render("x.exr", {"--size", "20x16", "--reference", "reference.exr"}));
}

TEST_F(Parts, ASkyLightsWhatHasNoLight) {
  square();
  succeed({"render", "square.glb", "--view", "front", "--size", "8x8", "--shading", "path", "--sky", "0.5,0.25,1",
           "--out", "sky.exr"});
  EXPECT_EQ(picture("sky.exr").channel("G").floats[0], 0.25f);
  succeed({"render", "square.glb", "--view", "front", "--size", "8x8", "--shading", "whitted", "--out", "auto.exr"});
  EXPECT_GT(picture("auto.exr").channel("G").floats[0], 0);
  refuse(2, {"sky blue", "gradient"}, {"render", "square.glb", "--sky", "blue"});
}

}  // namespace
}  // namespace ballot::test
