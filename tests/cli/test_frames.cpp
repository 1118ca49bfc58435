// Tests of pictures at a time of an animation: --time, --frames and their parts, and `info`, which lists animations.
#include "engine/files/image.h"
#include "tests/cli/cli.h"
#include "tests/cpu/animated.h"

namespace ballot::test {
namespace {

class Frames : public Cli {
 protected:
  /// Writes moving.glb: a triangle that moves by 10 in the second from 1 to 2, with a camera that follows it and one
  /// that does not, and a clip that lets everything be.
  void SetUp() override {
    AnimatedBuilder b = moving_triangle();
    b.json["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", 0.9}, {"znear", 0.1}}}}};
    b.json["nodes"][0]["children"] = {1};
    b.node({{"name", "rider"}, {"camera", 0}, {"translation", {0.3, 0.3, 3}}});
    b.node({{"name", "stander"}, {"camera", 0}, {"translation", {0.3, 0.3, 3}}});
    b.json["animations"][0]["name"] = "move";
    write("moving.glb", b.glb());
    b.channel(0, "translation", {0, 1}, b.vec3({0, 0, 0, 0, 0, 0}), "LINEAR", 1);
    b.json["animations"][1]["name"] = "stay";
    write("several.glb", b.glb());
  }

  static Words render_words(const std::string& out, const Words& more, const std::string& scene = "moving.glb") {
    Words words{"render", scene, "--size", "32x32", "--out", out, "--aov", "color,depth,prim"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }

  Image frame_picture(const std::string& name) const { return read_exr(path(name)); }

  std::size_t hit_pixels(const std::string& name) const {
    const Image image = frame_picture(name);
    return std::size_t(std::ranges::count(image.channel("prim").uints, 0u));
  }
};

TEST_F(Frames, ATimeMovesTrianglesAndCameras) {
  succeed(render_words("rest", {}));
  const std::size_t seen = hit_pixels("rest/moving-stander.exr");
  EXPECT_GT(seen, 50u);
  const Result run = succeed(render_words("end", {"--time", "2"}));
  EXPECT_EQ(run.err, "");
  EXPECT_EQ(hit_pixels("end/moving-stander.exr"), 0u);
  EXPECT_EQ(hit_pixels("end/moving-rider.exr"), seen);
  const Image end = frame_picture("end/moving-rider.exr");
  EXPECT_EQ(std::get<std::string>(end.attributes.at("animation")), "move");
  EXPECT_EQ(std::get<float>(end.attributes.at("time")), 2);
}

TEST_F(Frames, ATimeOutsideTheClipIsClampedAndSaid) {
  const Result late = succeed(render_words("late.exr", {"--time", "7.5", "--view", "rider"}));
  expect_parts(late.err, {"the time 7.5 s is outside animation 'move' of 2 s; the picture shows its end"});
  EXPECT_EQ(std::get<float>(frame_picture("late.exr").attributes.at("time")), 2);
  const Result early = succeed(render_words("early.exr", {"--time", "-1", "--view", "rider"}));
  expect_parts(early.err, {"the time -1 s is outside", "shows its beginning"});
}

TEST_F(Frames, FramesHaveNumbersAndTheBitsOfTheirTime) {
  const Result run =
      succeed(render_words("f.exr", {"--frames", "3..6", "--fps", "4", "--view", "stander", "--json", "f.json"}));
  expect_parts(run.out, {"frame 0003, 0.7500 s", "frame 0006, 1.5000 s"});
  EXPECT_EQ(files(), (std::set<std::string>{"f-0003.exr", "f-0004.exr", "f-0005.exr", "f-0006.exr", "f.json",
                                            "moving.glb", "several.glb"}));
  succeed(render_words("t.exr", {"--time", "1.25", "--view", "stander"}));
  const Image frame = frame_picture("f-0005.exr"), time = frame_picture("t.exr");
  for (const char* name : {"R", "Z"}) EXPECT_EQ(frame.channel(name).floats, time.channel(name).floats);
  EXPECT_EQ(std::get<int>(frame.attributes.at("frame")), 5);
  const nlohmann::json records = json("f.json")["records"];
  ASSERT_EQ(records.size(), 4u);
  EXPECT_EQ(records[1]["frame"], 4);
  EXPECT_EQ(records[1]["time"], 1.0);
  EXPECT_GT(records[1]["update_s"], 0.0);
}

TEST_F(Frames, CompleteFramesAreLeftOut) {
  const Words words = render_words("f", {"--frames", "0..4", "--fps", "2", "--resume", "--view", "rider"});
  Words part = words;
  part.insert(part.end(), {"--frame-part", "1/2"});
  succeed(part);
  EXPECT_TRUE(std::filesystem::exists(path("f/moving-rider-0003.exr")));
  EXPECT_FALSE(std::filesystem::exists(path("f/moving-rider-0002.exr")));
  expect_parts(succeed(words).out, {"2 pictures were complete and left out"});
  const std::string whole = read("f/moving-rider-0002.exr");
  write("f/moving-rider-0002.exr", std::string_view(whole).substr(0, whole.size() / 2));
  write("f/moving-rider-0004.exr", "");
  expect_parts(succeed(words).out, {"frame 0002", "frame 0004", "3 pictures were complete and left out"});
  EXPECT_EQ(read("f/moving-rider-0002.exr").size(), whole.size());
  Words other = words;
  other.insert(other.end(), {"--shading", "normals"});
  EXPECT_EQ(succeed(other).out.find("left out"), std::string::npos);
}

TEST_F(Frames, WrongOptionsAreRefused) {
  const auto no = [&](std::initializer_list<std::string_view> parts, const Words& more,
                      const std::string& scene = "moving.glb") { refuse(2, parts, render_words("o", more, scene)); };
  no({"--frames 5..2", "FIRST not above LAST"}, {"--frames", "5..2"});
  no({"--frames 1-3", "FIRST..LAST"}, {"--frames", "1-3"});
  no({"--frames 0..9999999", "at most 1000000"}, {"--frames", "0..9999999"});
  no({"--fps 0", "above 0"}, {"--frames", "0..1", "--fps", "0"});
  no({"--fps needs --frames"}, {"--fps", "25"});
  no({"--animation needs --time"}, {"--animation", "move"});
  no({"--frame-part 3/3", "expected I below N"}, {"--frames", "0..1", "--frame-part", "3/3"});
  no({"--frame-part 2/3", "no frame"}, {"--frames", "0..1", "--frame-part", "2/3"});
  no({"--time and --frames"}, {"--frames", "0..1", "--time", "1"});
  no({"--time nan"}, {"--time", "nan"});
  no({"--update sometimes", "auto, refit, rebuild"}, {"--frames", "0..1", "--update", "sometimes"});
  no({"has no animation 'run'", "0 move, 1 stay"}, {"--time", "1", "--animation", "run"}, "several.glb");
  no({"has several animations", "--animation: move, stay"}, {"--time", "1"}, "several.glb");
  no({"scene 'square' has no animation"}, {"--time", "1"}, square());
}

TEST_F(Frames, BenchMeasuresThemForEveryUpdate) {
  const Result run =
      succeed({"bench", "moving.glb", "--frames", "0..5", "--fps", "4", "--size", "32x32", "--json", "b.json"});
  expect_parts(run.out,
               {"animation move, view rider, 32 x 32", "| auto ", "| refit ", "| rebuild | 6 of 6", "build ms"});
  const nlohmann::json records = json("b.json")["records"];
  ASSERT_EQ(records.size(), 18u);
  EXPECT_EQ(records[8]["update"], "refit");
  EXPECT_EQ(records[8]["frame"], 2);
  for (const char* key : {"pose_ms", "tree_ms", "ready_ms", "trace_ms", "shade_ms", "wall_ms"})
    EXPECT_GT(records[8][key], 0.0) << key;
  refuse(2, {"--frames measures one scene; found 2"}, {"bench", "moving.glb", "several.glb", "--frames", "0..1"});
  refuse(2, {"--fps needs --frames"}, {"bench", "moving.glb", "--fps", "4"});
  refuse(2, {"there are auto, refit, rebuild"}, {"bench", "moving.glb", "--frames", "0..1", "--updates", "no"});
}

TEST_F(Frames, InfoListsAnimations) {
  const Result info = succeed({"info", "several.glb", "--json", "i.json"});
  expect_parts(info.out, {"| move", "| stay", "1 triangles move"});
  EXPECT_EQ(json("i.json")["animations"][0], (nlohmann::json{{"name", "move"}, {"seconds", 2.0}, {"channels", 1}}));
  EXPECT_TRUE(succeed({"info", square(), "--json", "s.json"}).out.find("animations, which") == std::string::npos);
  EXPECT_TRUE(json("s.json")["animations"].empty());
}

}  // namespace
}  // namespace ballot::test
