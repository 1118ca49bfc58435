// Tests of `ballot info`: the list of devices, the statistics of a scene, its triangles and its kernels.
#include <algorithm>
#include <regex>

#include "engine/answer/methods.h"
#include "engine/render/path/integrators.h"
#include "tests/cli/cli.h"

namespace ballot::test {
namespace {

class Info : public Cli {};

TEST_F(Info, ListsDevices) {
  const Result info = succeed({"info", "--json", "info.json"});
  expect_parts(info.out, {"* ", "0: ", "subgroup", "driver", "Vulkan", "is used"});
  const auto devices = json("info.json")["devices"];
  ASSERT_GE(devices.size(), 1u);
  for (const auto& d : devices)
    for (const char* field :
         {"name", "driver", "subgroup_size", "min_subgroup_size", "max_subgroup_size", "refusals", "lacks"})
      EXPECT_TRUE(d.contains(field)) << field;
  EXPECT_FALSE(json("info.json").contains("scenes"));
}

TEST_F(Info, TheSelfTestFindsKnownAnswersAndDraws) {
  const Result test = succeed({"selftest", "--json", "test.json"});
  expect_parts(test.out, {"ballot    ", ", commit ", "caches    ", "* ", "is used", "10000 rays, 0 wrong",
                          "1000 closest points, 0 wrong", "the first call took", "@@"});
  EXPECT_EQ(json("test.json")["wrong_hits"], 0);
  EXPECT_GE(json("test.json")["devices"].size(), 1u);
  succeed({"selftest", "--png", "ball.png"});
  EXPECT_GT(std::filesystem::file_size(path("ball.png")), 1000u);
  const Environment read_only{{"XDG_CACHE_HOME", "/proc/ballot"}};
  expect_parts(succeed({"selftest"}, read_only).out, {"/proc/ballot", "it cannot be written", "0 wrong"});
  refuse(3, {"no Vulkan device", "apt install mesa-vulkan-drivers"}, {"selftest"},
         {{"VK_DRIVER_FILES", "/nonexistent/driver.json"}, {"VK_ICD_FILENAMES", "/nonexistent/driver.json"}});
  refuse(2, {"no device is called 'Voodoo'"}, {"selftest", "--device", "Voodoo"});
}

TEST_F(Info, ASceneWithEveryVariant) {
  square();
  const Result info = succeed({"info", "square.glb", "--validate", "--json", "info.json"});
  expect_parts(info.out, {"scene square: 2 triangles", "views: front, far", "BVH:", "depth",
                          "bounds (-1, -1, 0) to (1, 1, 0)", "nothing beyond plain triangles"});
  const auto all = json("info.json");
  for (const char* field : {"device", "driver", "subgroup_size", "commit", "command"})
    EXPECT_TRUE(all.contains(field)) << field;
  ASSERT_EQ(all["scenes"].size(), 1u);
  for (const char* field : {"name", "triangles", "references", "nodes", "sah", "depth", "bytes", "build_s"})
    EXPECT_TRUE(all["scenes"][0].contains(field)) << field;
  EXPECT_EQ(all["scenes"][0]["triangles"], 2);
  EXPECT_EQ(all["scenes"][0]["name"], "square");
  for (const Method& m : kMethods) expect_parts(info.out, {m.name});
  EXPECT_EQ(all["variants"].size(), std::size(kMethods) - 1);  // method auto has no kernel of its own
  EXPECT_EQ(all["auto"].size(), 4 * std::size(kRayKinds));
  expect_parts(info.out, {"method auto takes", "diffuse", "shadow (any)"});
  expect_parts(all["command"], {"info square.glb --validate --json info.json"});
}

TEST_F(Info, MeshesWithAnyNames) {
  std::string obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\ng \x1b[31mred|\nf 1 2 3\n";
  const std::string lengthy(5000, 'x');
  obj += "g " + lengthy + "\nf 1 2 3\nf 1 2 3\n";
  for (int i = 0; i < 25; ++i) obj += "g \xc3\xa9\xff" + std::to_string(i % 5) + "\nf 1 2 3\n";
  write("many.obj", obj);
  const Result info = succeed({"info", "many.obj", "--json", "info.json"});
  expect_parts(info.out, {"27 meshes, each placed once, where it lies:\n", "\\x1b[31mred\\|", "xxxx...", "\\xff4",
                          "(0, 0, 0) to (1, 1, 0)", "... and 7 more meshes; --json lists all"});
  EXPECT_EQ(info.out.find('\x1b'), std::string::npos);
  EXPECT_EQ(info.out.find(std::string(50, 'x')), std::string::npos);
  const auto all = json("info.json");
  EXPECT_EQ(all["materials"], nlohmann::json::array({"default"}));
  ASSERT_EQ(all["meshes"].size(), 27u);
  ASSERT_EQ(all["instances"].size(), 27u);
  EXPECT_EQ(all["meshes"][1]["name"], lengthy);
  EXPECT_EQ(all["meshes"][1]["first"], 1);
  EXPECT_EQ(all["meshes"][1]["triangles"], 2);
  EXPECT_EQ(all["meshes"][26]["id"], 6);
  EXPECT_EQ(all["meshes"][26]["material"], 0);
  EXPECT_EQ(all["instances"][26]["mesh"], 26);
  EXPECT_EQ(all["instances"][26]["bounds"], nlohmann::json::array({{0, 0, 0}, {1, 1, 0}}));
}

TEST_F(Info, TrianglesAsNumPy) {
  square();
  succeed({"info", "square.glb", "--triangles", "triangles.npy"});
  const std::string npy = read("triangles.npy");
  expect_parts(npy, {"\x93NUMPY", "'<f4'", "(2, 3, 3)"});
  const float expected[] = {-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, -1, 0, 1, 1, 0, -1, 1, 0};
  ASSERT_GT(npy.size(), sizeof expected);
  EXPECT_TRUE(std::equal(npy.end() - sizeof expected, npy.end(), reinterpret_cast<const char*>(expected)));
}

TEST_F(Info, TheSecondRunReadsTheCache) {
  square();
  succeed({"info", "square.glb", "--json", "first.json"});
  succeed({"info", "square.glb", "--json", "second.json"});
  succeed({"info", "square.glb", "--json", "third.json", "--no-cache"});
  EXPECT_FALSE(json("first.json")["scenes"][0]["from_cache"]);
  EXPECT_TRUE(json("second.json")["scenes"][0]["from_cache"]);
  EXPECT_FALSE(json("third.json")["scenes"][0]["from_cache"]);
}

TEST_F(Info, AnEmptySceneIsAScene) {
  empty();
  const Result info = succeed({"info", "empty.glb", "--validate", "--triangles", "none.npy"});
  expect_parts(info.out, {"0 triangles", "views: front"});
  expect_parts(read("none.npy"), {"(0, 3, 3)"});
}

TEST_F(Info, Refusals) {
  square();
  refuse(2, {"--triangles needs a SCENE"}, {"info", "--triangles", "t.npy"});
  refuse(1, {"none.glb", "no such scene file"}, {"info", "none.glb"});
  refuse(1, {"nowhere/t.npy", "no folder nowhere"}, {"info", "square.glb", "--triangles", "nowhere/t.npy"});
  refuse(1, {"nowhere/i.json", "no folder nowhere"},
         {"info", "square.glb", "--triangles", "t.npy", "--json", "nowhere/i.json"});
  refuse(1, {"nowhere/i.json", "no folder nowhere"}, {"info", "--json", "nowhere/i.json"});
}

TEST_F(Info, KernelsOfIntegratorsFollowFromTheScene) {
  square();
  const Result result = succeed({"info", "square.glb", "--sky", "gradient", "--json", "info.json"});
  expect_parts(result.out, {"integrators", "whitted.scatter", "path.scatter", "holds: sky"});
  const nlohmann::json info = json("info.json");
  EXPECT_EQ(info.at("integrators").size(), std::size(kIntegrators));
  for (const auto& integrator : info.at("integrators"))
    for (const auto& kernel : integrator.at("kernels")) {
      EXPECT_GT(kernel.at("spirv_bytes"), 0);
      EXPECT_EQ(std::string(kernel.at("name")).find("normals"), std::string::npos);
    }
}

TEST_F(Info, CamerasAndTheTreeAreFeatures) {
  square();
  const Result result = succeed({"info", "square.glb", "--json", "info.json"});
  expect_parts(result.out, {"cameras: perspective\n", "leaves of at most 2", "depth 0", "stacks of 16 entries",
                            "rays.primary.listed+perspective"});
  EXPECT_EQ(result.out.find("+orthographic"), std::string::npos);
  const auto features = json("info.json").at("features");
  EXPECT_EQ(features.at("cameras"), nlohmann::json::array({"perspective"}));
  EXPECT_EQ(features.at("holds"), nlohmann::json::array());
  EXPECT_EQ(features.at("tree_depth"), 0);
  EXPECT_EQ(features.at("largest_leaf"), 2);
  EXPECT_EQ(json("info.json").at("traversal").at("stack_entries"), 16);
  orthographic();
  const Result plan = succeed({"info", "orthographic.glb", "--validate"});
  expect_parts(plan.out, {"cameras: orthographic\n", "rays.primary.listed+orthographic"});
  EXPECT_EQ(plan.out.find("+perspective"), std::string::npos);
}

TEST_F(Info, LightOfACommandLineIsPartOfTheScene) {
  square();
  const Result result = succeed({"info", "square.glb", "--lamp", "eye:1,1,1", "--sky", "1,1,1"});
  expect_parts(result.out, {"punctual lights", "path.scatter+lights+sky"});
  // On GPUs the scatter kernel generates the camera rays, so the kind of camera is part of its name.
  const std::regex with_more("path\\.scatter\\+(?!perspective)");
  EXPECT_FALSE(std::regex_search(succeed({"info", "square.glb"}).out, with_more));
  refuse(2, {"--sky needs a SCENE"}, {"info", "--sky", "gradient"});
  refuse(2, {"--lamp dark"}, {"info", "square.glb", "--lamp", "dark"});
}

}  // namespace
}  // namespace ballot::test
