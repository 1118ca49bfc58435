// Tests of `ballot render --denoise`, with a stand-in for the library (fake_denoiser.cpp).
#include <cmath>

#include "engine/core/registry.h"
#include "engine/files/image.h"
#include "engine/render/path/integrators.h"
#include "tests/cli/cli.h"

namespace ballot::test {
namespace {

class Denoise : public Cli {
 protected:
  void SetUp() override { square(); }
  const Environment fake_{{"BALLOT_DENOISER", BALLOT_FAKE_DENOISER}};
};

TEST_F(Denoise, TheLibraryGetsColoursAlbedoAndNormals) {
  const Words common = {"render",    "square.glb", "--view", "front", "--size", "24x16",
                        "--shading", "path",       "--spp",  "4",     "--sky",  "0.5,0.5,0.5"};
  Words noisy = common, clean = common;
  noisy.insert(noisy.end(), {"--out", "noisy.exr"});
  clean.insert(clean.end(), {"--denoise", "--out", "clean.exr", "--png", "--validate"});
  succeed(noisy);
  EXPECT_EQ(succeed(clean, fake_).err, "");
  const Image before = read_exr(path("noisy.exr")), after = read_exr(path("clean.exr"));
  EXPECT_EQ(std::get<std::string>(after.attributes.at("denoiser")), "Open Image Denoise 1.9.7");
  EXPECT_EQ(before.channel("N.Z").floats, after.channel("N.Z").floats);
  const std::size_t middle = 8 * 24 + 12, corner = 0;
  EXPECT_EQ(before.channel("A").floats[corner], 0) << "the square fills the picture";
  EXPECT_GT(after.channel("albedo.R").floats[middle], 0.1);
  for (const char* c : {"R", "G", "B"}) {
    const std::string name(c);
    EXPECT_EQ(before.channel(name).floats, after.channel("noisy." + name).floats);
    EXPECT_EQ(after.channel("albedo." + name).floats[corner], 0);
    const float normal = name == "B" ? 1.0f : 0.0f;  // the square faces +z
    const float expected = before.channel(name).floats[middle] / 2 + after.channel("albedo." + name).floats[middle] / 4;
    EXPECT_NEAR(after.channel(name).floats[middle], expected + normal / 8, 1e-3);
    EXPECT_NEAR(after.channel(name).floats[corner], before.channel(name).floats[corner] / 2, 1e-3);
  }
}

TEST_F(Denoise, ErrorsSayWhatIsMissing) {
  refuse(1, {"BALLOT_DENOISER: cannot load Open Image Denoise", "no.so"},
         {"render", "square.glb", "--shading", "path", "--denoise", "--out", "a.exr"}, {{"BALLOT_DENOISER", "no.so"}});
  refuse(1, {"Open Image Denoise: a fault that was asked for"},
         {"render", "square.glb", "--view", "front", "--shading", "path", "--spp", "1", "--size", "7x5", "--denoise",
          "--out", "a.exr"},
         fake_);
  refuse(2, {"--denoise: shading 'eyelight' has no noise; it is for " + names_of(kIntegrators)},
         {"render", "square.glb", "--denoise"});
  refuse(2, {"--denoise: needs the whole picture"},
         {"render", "square.glb", "--shading", "ao", "--denoise", "--tiles", "0/2"});
  EXPECT_EQ(files(), (std::set<std::string>{"square.glb"}));
}

}  // namespace
}  // namespace ballot::test
