// Tests of pictures that are rendered in bands of rows: they have the pixels of a picture that is rendered whole.
#include "engine/core/file.h"
#include "engine/files/image.h"
#include "tests/cli/cli.h"

namespace ballot::test {
namespace {

namespace fs = std::filesystem;

class Bands : public Cli {
 protected:
  static Words render(const std::string& out, const Words& more) {
    Words words{"render", BALLOT_SOURCE_DIR "/scenes/cornell.gltf", "--view", "view0", "--size", "72x70", "--out", out};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }

  /// Expects that two pictures have the same channels, size and place, and that no band is left.
  void expect_same(const std::string& one, const std::string& other) const {
    const Image a = read_exr(path(one)), b = read_exr(path(other));
    EXPECT_EQ(a.x, b.x);
    EXPECT_EQ(a.y, b.y);
    EXPECT_EQ(a.width, b.width);
    EXPECT_EQ(a.height, b.height);
    EXPECT_EQ(a.full_height, b.full_height);
    ASSERT_EQ(a.channels.size(), b.channels.size());
    for (std::size_t c = 0; c < a.channels.size(); ++c) {
      EXPECT_EQ(a.channels[c].name, b.channels[c].name);
      EXPECT_EQ(a.channels[c].floats, b.channels[c].floats) << a.channels[c].name;
      EXPECT_EQ(a.channels[c].uints, b.channels[c].uints) << a.channels[c].name;
    }
    for (const auto& [name, value] : a.attributes) {
      if (name == "seconds" || name == "method") continue;
      ASSERT_TRUE(b.attributes.contains(name)) << name;
      EXPECT_TRUE(b.attributes.at(name) == value) << name;
    }
    EXPECT_EQ(a.attributes.size(), b.attributes.size());
    for (const fs::directory_entry& entry : fs::directory_iterator(path("")))
      EXPECT_EQ(entry.path().string().find(".rows-"), std::string::npos) << entry.path();
  }
};

TEST_F(Bands, HaveThePixelsOfTheWholePicture) {
  const Words all{"--shading", "path", "--spp", "3", "--png", "--aov", "color,depth,normal,prim,samples,variance"};
  const auto with = [](Words words, const Words& more) {
    words.insert(words.end(), more.begin(), more.end());
    return words;
  };
  succeed(render("whole.exr", all));
  const std::string said = succeed(render("bands.exr", with(all, {"--band", "20"}))).out;
  EXPECT_NE(said.find("72 x 70 pixels in 3 bands of 32 rows: about "), said.npos) << said;
  expect_same("whole.exr", "bands.exr");
  EXPECT_EQ(read_file(path("whole.png")), read_file(path("bands.png")));
  succeed(render("crop.exr", {"--crop", "8,5,60,69"}));
  succeed(render("crop-bands.exr", {"--crop", "8,5,60,69", "--band", "32"}));
  expect_same("crop.exr", "crop-bands.exr");
}

// The last colour of a heat map follows from all bands.
TEST_F(Bands, HaveTheCountersOfTheWholePicture) {
  succeed(render("whole.exr", {"--shading", "heat", "--method", "while-while"}));
  succeed(render("bands.exr", {"--shading", "heat", "--method", "while-while", "--band", "32"}));
  expect_same("whole.exr", "bands.exr");
}

TEST_F(Bands, AreMerged) {
  succeed(render("whole.exr", {}));
  for (const char* part : {"0", "1"})
    succeed(render(fmt::format("part{}.exr", part), {"--tiles", fmt::format("{}/2", part), "--band", "32"}));
  succeed({"merge", "part0.exr", "part1.exr", "--out", "merged.exr"});
  const Image whole = read_exr(path("whole.exr")), merged = read_exr(path("merged.exr"));
  for (std::size_t c = 0; c < whole.channels.size(); ++c)
    EXPECT_EQ(whole.channels[c].floats, merged.channels[c].floats) << whole.channels[c].name;
}

// A run that was killed leaves its finished bands, which the next one takes over with --resume.
TEST_F(Bands, AreTakenOver) {
  const Words words = render("out.exr", {"--shading", "path", "--spp", "32", "--band", "32"});
  Words whole = words;
  whole[7] = "whole.exr";
  whole.resize(whole.size() - 2);
  succeed(whole);
  kill_when_there_is("out.rows-0-31.exr", words);
  EXPECT_FALSE(fs::exists(path("out.exr")));
  Words again = words;
  again.push_back("--resume");
  const std::string said = succeed(again).out;
  EXPECT_NE(said.find(" of 3 bands were complete"), said.npos) << said;
  expect_same("whole.exr", "out.exr");
}

// Files beside a picture have names that others can guess: a link there must not lead their bytes elsewhere.
TEST_F(Bands, ReplaceLinks) {
  write("mine.txt", "mine");
  for (const char* name : {"out.rows-0-31.exr", "out.rows-32-63.exr"}) fs::create_symlink(path("mine.txt"), path(name));
  succeed(render("out.exr", {"--band", "32"}));
  EXPECT_EQ(read("mine.txt"), "mine");
}

TEST_F(Bands, ThatDoNotFitAreRefused) {
  Words words = render("big.exr", {"--band", "16384", "--memory", "2G"});
  words[5] = "16384x16384";
  const std::string said = run(words).err;
  EXPECT_NE(said.find("view view0 of 16384 x 16384 pixels needs about "), said.npos) << said;
  EXPECT_NE(said.find("left of the limit of 2.00 GiB"), said.npos) << said;
  EXPECT_NE(said.find("--band with fewer rows"), said.npos) << said;
  EXPECT_FALSE(fs::exists(path("big.exr")));
}

}  // namespace
}  // namespace ballot::test
