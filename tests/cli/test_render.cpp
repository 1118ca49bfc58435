// Tests of `ballot render`, which writes views of a scene to image files.
#include <unistd.h>

#include <cmath>

#include "engine/answer/methods.h"
#include "engine/answer/numeric.h"
#include "engine/files/image.h"
#include "tests/cli/cli.h"
#include "tests/cpu/gltf_builder.h"

namespace ballot::test {
namespace {

class Render : public Cli {
 protected:
  void SetUp() override { square(); }

  Image picture(const std::string& name) const { return read_exr(path(name)); }
};

TEST_F(Render, OneViewToOneFile) {
  const Result result =
      succeed({"render", "square.glb", "--view", "far", "--size", "24x16", "--out", "far.exr", "--validate"});
  EXPECT_EQ(result.err, "");
  expect_parts(result.out, {"far", "Mrays/s", "far.exr", "square: 2 triangles"});
  EXPECT_EQ(files(), (std::set<std::string>{"square.glb", "far.exr"}));
  const Image image = picture("far.exr");
  EXPECT_EQ(image.width, 24u);
  EXPECT_EQ(image.height, 16u);
  EXPECT_EQ(std::get<std::string>(image.attributes.at("view")), "far");
  for (const char* name : {"R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z", "prim"})
    EXPECT_NO_THROW(image.channel(name)) << name;
  EXPECT_EQ(image.channel("A").floats[8 * 24 + 12], 1);
  EXPECT_EQ(image.channel("prim").uints[0], NO_HIT);
}

TEST_F(Render, EveryViewToAFolder) {
  succeed({"render", "square.glb", "--size", "8x8", "--out", "deep/pictures", "--png", "--json", "render.json",
           "--validate"});
  EXPECT_EQ(files(), (std::set<std::string>{"square.glb", "render.json", "deep", "deep/pictures",
                                            "deep/pictures/square-front.exr", "deep/pictures/square-front.png",
                                            "deep/pictures/square-far.exr", "deep/pictures/square-far.png"}));
  EXPECT_TRUE(read("deep/pictures/square-far.png").starts_with("\x89PNG"));
  const auto near_z = picture("deep/pictures/square-front.exr").channel("Z").floats[4 * 8 + 4];
  const auto far_z = picture("deep/pictures/square-far.exr").channel("Z").floats[4 * 8 + 4];
  EXPECT_GT(near_z, 3);
  EXPECT_LT(near_z, 3.1);
  EXPECT_GT(far_z, 6);
}

TEST_F(Render, JsonHasTheContractsNames) {
  succeed({"render", "square.glb", "--size", "9x5", "--spp", "2", "--out", "p", "--json", "render.json", "--knob",
           "stack=private", "--method", "if-if"});
  const auto all = json("render.json");
  for (const char* field : {"device", "driver", "subgroup_size", "commit", "command", "scenes", "records"})
    EXPECT_TRUE(all.contains(field)) << field;
  ASSERT_EQ(all["records"].size(), 2u);
  for (const auto& record : all["records"])
    for (const char* field :
         {"scene", "view", "rays", "any", "method", "knobs", "numeric", "ray_count", "mrays_per_s", "trace_ms"})
      EXPECT_TRUE(record.contains(field)) << field;
  const auto first = all["records"][0];
  EXPECT_EQ(first["view"], "front");
  EXPECT_EQ(first["rays"], "primary");
  EXPECT_EQ(first["method"], "if-if");
  EXPECT_EQ(first["knobs"], (nlohmann::json{{"stack", "private"}}));
  EXPECT_EQ(first["ray_count"], 90);
  EXPECT_EQ(first["spp"], 2);
}

TEST_F(Render, AllInTheWorkingFolderByDefault) {
  succeed({"render", "square.glb", "--size", "4x4"});
  EXPECT_EQ(files(), (std::set<std::string>{"square.glb", "square-front.exr", "square-far.exr"}));
}

TEST_F(Render, EveryMethodAndModeAgrees) {
  for (const Method& method : kMethods)
    for (const NumericMode& mode : kNumericModes) {
      if (method.name != kDefaultMethod && mode.name != kDefaultNumeric) continue;
      SCOPED_TRACE(std::string(method.name) + " " + std::string(mode.name));
      succeed({"render", "square.glb", "--view", "front", "--size", "17x5", "--out", "p.exr", "--validate", "--method",
               std::string(method.name), "--numeric", std::string(mode.name)});
      const Image image = picture("p.exr");
      const auto& runs = std::get<std::string>(image.attributes.at("method"));
      EXPECT_TRUE(method.chooses ? !runs.starts_with(method.name) : runs.starts_with(method.name)) << runs;
      EXPECT_EQ(std::get<std::string>(image.attributes.at("numeric")), mode.name);
      EXPECT_NEAR(image.channel("Z").floats[2 * 17 + 8], 3, 1e-5);
    }
}

TEST_F(Render, ShadingAndSamples) {
  succeed({"render", "square.glb", "--view", "front", "--size", "5x5", "--out", "n.exr", "--shading", "normals",
           "--validate"});
  const Image normals = picture("n.exr");
  EXPECT_NEAR(normals.channel("R").floats[12], 0.5, 1e-3);
  EXPECT_NEAR(normals.channel("B").floats[12], 1, 1e-3);
  succeed({"render", "square.glb", "--view", "front", "--size", "5x5", "--out", "s.exr", "--spp", "4", "--validate"});
  EXPECT_EQ(std::get<int>(picture("s.exr").attributes.at("spp")), 4);
}

TEST_F(Render, AnEmptySceneIsBackground) {
  empty();
  succeed({"render", "empty.glb", "--size", "6x4", "--out", "e.exr", "--validate"});
  const Image image = picture("e.exr");
  for (const float a : image.channel("A").floats) EXPECT_EQ(a, 0);
  for (const std::uint32_t prim : image.channel("prim").uints) EXPECT_EQ(prim, NO_HIT);
}

TEST_F(Render, ViewsWithOddNamesStayInTheFolder) {
  GltfBuilder b = one_triangle();
  for (const char* name : {"up/../../stairs", "a/b", "a_b"}) {
    b.json["cameras"].push_back(
        {{"type", "perspective"}, {"name", name}, {"perspective", {{"yfov", 1.0}, {"znear", 0.1}}}});
    b.node({{"name", name}, {"camera", b.json["cameras"].size() - 1}, {"translation", {0, 0, 3}}});
  }
  write("odd.glb", b.glb());
  std::filesystem::create_directories(path("p/odd-up"));
  succeed({"render", "odd.glb", "--size", "4x4", "--out", "p", "--json", "r.json"});
  std::set<std::string> written;
  const auto records = json("r.json")["records"];
  for (const auto& record : records) written.insert(record["exr"]);
  EXPECT_EQ(written.size(), 3u) << "two views were written to the same file";
  for (const std::string& name : written) {
    EXPECT_EQ(std::filesystem::path(name).parent_path(), "p");
    EXPECT_TRUE(files().contains(name)) << name;
  }
}

TEST_F(Render, BadSizesAndSamples) {
  for (const char* size : {"32", "32x", "x32", "axb", "-3x4", "4x4x4", "4 x4", "99999999999x1", ""})
    refuse(2, {"--size"}, {"render", "square.glb", "--size", size});
  for (const char* size : {"0x4", "4x0", "16385x1", "1x16385"})
    refuse(2, {"size: ", "between 1x1 and 16384x16384"}, {"render", "square.glb", "--size", size});
  refuse(2, {"spp: ", "between 1 and 65536"}, {"render", "square.glb", "--size", "4x4", "--spp", "0"});
  refuse(2, {"spp: ", "between 1 and 65536"}, {"render", "square.glb", "--size", "4x4", "--spp", "65537"});
  for (const char* spp : {"-1", "x", "1.5"})
    refuse(2, {"--spp"}, {"render", "square.glb", "--size", "4x4", "--spp", spp});
}

TEST_F(Render, UnknownNames) {
  const auto with = [&](const char* option, const char* value) {
    return Words{"render", "square.glb", "--size", "4x4", "--out", "p", option, value};
  };
  refuse(2, {"no view 'side'", "front, far"}, with("--view", "side"));
  refuse(2, {"no traversal method is called 'pocket'", "packet"}, with("--method", "pocket"));
  refuse(2, {"no numeric mode is called 'half'", "watertight"}, with("--numeric", "half"));
  refuse(2, {"no shading is called 'photo'", "eyelight"}, with("--shading", "photo"));
  refuse(2, {"no heat map is called 'warmth'", "nodes, triangles, lanes, phase"}, with("--heat", "warmth"));
  refuse(2, {"no knob is called 'speed'", "vote"}, with("--knob", "speed=11"));
  refuse(2, {"NAME=VALUE", "'vote'"}, with("--knob", "vote"));
  refuse(2, {"knob vote", "'some'", "any, count, sum"}, with("--knob", "vote=some"));
  refuse(2, {"knob workgroup", "4 to 1024"}, with("--knob", "workgroup=big"));
  refuse(2, {"no device is called 'abacus'", "0: "}, with("--device", "abacus"));
  refuse(2, {"no device is called '99'", "0: "}, with("--device", "99"));
}

TEST_F(Render, BadOutputs) {
  std::filesystem::create_directories(path("folder.exr"));
  std::filesystem::create_directories(path("one.png"));
  write("file", "x");
  const auto to = [](const char* out) {
    return Words{"render", "square.glb", "--size", "4x4", "--view", "front", "--png", "--out", out};
  };
  refuse(1, {"nowhere/a.exr", "no folder nowhere"}, to("nowhere/a.exr"));
  refuse(1, {"folder.exr", "it is a folder"}, to("folder.exr"));
  refuse(1, {"--out file", "Not a directory"}, to("file"));
  refuse(1, {"one.png", "it is a folder"}, to("one.exr"));
  refuse(1, {"--out"}, to(""));
  refuse(2, {"2 views do not fit one file", "--view"}, {"render", "square.glb", "--size", "4x4", "--out", "all.exr"});
  refuse(1, {"nowhere/r.json"},
         {"render", "square.glb", "--size", "4x4", "--view", "front", "--out", "a.exr", "--json", "nowhere/r.json"});
}

TEST_F(Render, AFolderThatMayNotBeWritten) {
  // No user can create files in /proc, not even root.
  refuse(1, {"cannot write /proc/square-"}, {"render", "square.glb", "--size", "4x4", "--out", "/proc"});
}

TEST_F(Render, DefaultsSuitTheShading) {
  square();
  const auto record = [&](const Words& more) {
    Words words{"render",   "square.glb", "--view", "front", "--size", "8x8",   "--sky",
                "30,30,30", "--out",      "p.exr",  "--png", "--json", "p.json"};
    words.insert(words.end(), more.begin(), more.end());
    succeed(words);
    return json("p.json")["records"][0];
  };
  const auto attribute = [&](const char* name) { return read_exr(path("p.exr")).attributes.contains(name); };
  EXPECT_EQ(record({"--shading", "path"})["spp"], 64);
  EXPECT_TRUE(attribute("tone") && attribute("clamp") && !attribute("exposure"));
  EXPECT_EQ(read_exr(path("p.exr")).channel("R").floats[0], 20);  // the sky, clamped
  EXPECT_EQ(record({"--shading", "path", "--clamp", "0", "--spp", "4", "--tone", "none", "--exposure", "-2"})["spp"],
            4);
  EXPECT_TRUE(!attribute("tone") && !attribute("clamp") && attribute("exposure"));
  EXPECT_EQ(read_exr(path("p.exr")).channel("R").floats[0], 30);
  EXPECT_EQ(record({"--shading", "whitted"})["spp"], 16);
  EXPECT_TRUE(attribute("tone") && !attribute("clamp"));
  EXPECT_EQ(record({})["spp"], 1);
  EXPECT_FALSE(attribute("tone"));
  refuse(2, {"--tone: 'film' is none of auto, neutral, none"}, {"render", "square.glb", "--tone", "film"});
  refuse(2, {"--exposure: 99"}, {"render", "square.glb", "--exposure", "99"});
  refuse(2, {"clamp: -1"}, {"render", "square.glb", "--clamp", "-1"});
}

}  // namespace
}  // namespace ballot::test
