// Tests that the help texts list every command, option and name, and that unknown words are refused.
#include <algorithm>
#include <sstream>

#include "engine/answer/knobs.h"
#include "engine/answer/numeric.h"
#include "engine/render/film/renderer.h"
#include "tests/cli/cli.h"

namespace ballot::test {
namespace {

class Help : public Cli {};

TEST_F(Help, NamesCommandsExamplesAndExitCodes) {
  const Result help = succeed({"--help"});
  expect_parts(help.out,
               {"info", "render", "trace", "view", "bench", "verify", "methods", "shaders", "selftest",
                "Examples:", "0 done", "1 the work failed", "2 the arguments are wrong", "3 no usable device"});
  EXPECT_EQ(help.err, "");
}

TEST_F(Help, FitsAScreenAndHidesNoName) {
  for (const char* command : {"", "info", "render", "merge", "trace", "distance", "inside", "check", "view", "bench",
                              "verify", "methods", "shaders", "selftest"}) {
    SCOPED_TRACE(command);
    const Words words = *command ? Words{command} : Words{};
    Words short_words = words, long_words = words;
    short_words.emplace_back("--help"), long_words.emplace_back("--help-all");
    const std::string brief = succeed(short_words).out, whole = succeed(long_words).out;
    EXPECT_LE(std::ranges::count(brief, '\n'), 40);
    std::size_t hidden = 0;
    std::istringstream lines(brief), all_lines(whole);
    for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 120u) << line;
    for (std::string line; std::getline(all_lines, line);) {
      const bool option = line.starts_with("  --") || line.starts_with("  -v,--");
      hidden += option && brief.find("\n" + line.substr(0, line.find(' ', 2) + 1)) == std::string::npos;
    }
    const std::size_t at = brief.find(" options more");
    const std::size_t number = at == std::string::npos ? at : brief.rfind(' ', at - 1);
    const std::size_t said = at == std::string::npos ? 0 : std::stoul(brief.substr(number));
    EXPECT_TRUE(!*command || hidden == said) << hidden << " hidden, " << said << " said";
  }
  const std::string brief = succeed({"render", "--help"}).out;
  for (const Method& m : kMethods) expect_parts(brief, {m.name});
  for (const Shading& s : kShadings) expect_parts(brief, {s.name});
}

TEST_F(Help, Version) {
  const Result version = succeed({"--version"});
  EXPECT_TRUE(version.out.starts_with("ballot ") && version.out.find(", commit ") != std::string::npos) << version.out;
}

TEST_F(Help, WordsSpeltWrongAreNamed) {
  refuse(2, {"there is no command 'rendr'; the commands are: info, render"}, {"rendr"});
  refuse(2, {"render: there is no option '--szie'; 'ballot render --help' lists"}, {"render", "a.glb", "--szie=3"});
  refuse(2, {"there is no option '--szie'"}, {"render", "a.glb", "--szie", "3"});
  square();
  refuse(2, {"no shading is called 'pth'; there are: eyelight", "whitted, path"},
         {"render", "square.glb", "--shading", "pth"});
  refuse(2, {"has no view 'frnt'; there are: front, far"}, {"render", "square.glb", "--view", "frnt"});
  refuse(2, {"info: 'b.glb' is one argument too many"}, {"info", "a.glb", "b.glb"});
}

TEST_F(Help, OfInfo) {
  expect_parts(succeed({"info", "--help-all"}).out, {"SCENE", ".gltf", ".glb", ".obj", "--device", "'gpu'", "'cpu'",
                                                     "--triangles", "(n,3,3)", "--json", "--validate", "--no-cache"});
}

TEST_F(Help, OfTraceAndRenderListEveryMethodModeAndKnob) {
  for (const char* command : {"trace", "render"}) {
    SCOPED_TRACE(command);
    const std::string text = succeed({command, "--help-all"}).out;
    expect_parts(
        text, {"--method", "--numeric", "--knob", "NAME=VALUE", "--device", "--json", kDefaultMethod, kDefaultNumeric});
    for (const Method& m : kMethods) expect_parts(text, {m.name, m.summary});
    for (const NumericMode& m : kNumericModes) expect_parts(text, {m.name, m.summary});
    for (const KnobInfo& k : knobs()) expect_parts(text, {k.name, k.values, k.what});
  }
}

TEST_F(Help, OfTraceTeachesTheRecords) {
  expect_parts(succeed({"trace", "--help"}).out, {"--rays", "--out", "--any", "float32 (n,8)",
                                                  "ox oy oz t_min dx dy dz t_max", "('prim','<u4')", "4294967295"});
}

TEST_F(Help, OfRenderListsShadings) {
  const std::string text = succeed({"render", "--help-all"}).out;
  expect_parts(text, {"--view", "--size", "WIDTHxHEIGHT", "--spp", "--out", "--png", "--shading"});
  for (const Shading& s : kShadings) expect_parts(text, {s.name, s.summary});
}

TEST_F(Help, SplitBudgetsRangeIsTheLibrarysOwn) {
  square();
  const std::string text = succeed({"info", "--help-all"}).out;
  expect_parts(text, {"0 to 16"});
  for (const Builder& b : kBuilders) expect_parts(text, {b.name, b.summary});
  refuse(2, {"no BVH builder is called 'bset'", "best, balanced, fast"}, {"info", "square.glb", "--build", "bset"});
  refuse(2, {"split_budget is 17", "between 0 and 16"}, {"info", "square.glb", "--split-budget", "17"});
  refuse(2, {"max_leaf is 7", "1 to 6"}, {"info", "square.glb", "--max-leaf", "7"});
}

TEST_F(Help, OfViewListsEverythingThatCanBeSwitched) {
  const std::string text = succeed({"view", "--help-all"}).out;
  expect_parts(text, {"--views-file", "--target", "--frames", "H help"});
  for (const Method& m : kMethods) expect_parts(text, {m.name, m.summary});
  for (const Shading& s : kShadings) expect_parts(text, {s.name, s.summary});
  for (const Integrator& i : kIntegrators) expect_parts(text, {i.name, i.summary});
}

TEST_F(Help, WordsThatWindowsDoNotTake) {
  square();
  refuse(2, {"--shading path: it traces rays of its own; leave out --rays\n"},
         {"view", "square.glb", "--shading", "path", "--rays", "shadow"});
  refuse(2, {"no shading is called 'paht'"}, {"view", "square.glb", "--shading", "paht"});
}

TEST_F(Help, AMissingSceneIsFailedWorkEverywhere) {
  for (const char* command : {"info", "render", "check", "view", "bench", "verify"}) {
    SCOPED_TRACE(command);
    refuse(1, {"no.gltf: there is no such scene file"}, {command, "no.gltf"});
  }
  rays(4);
  refuse(1, {"no.gltf: there is no such scene file"}, {"trace", "no.gltf", "--rays", "rays.npy", "--out", "h.npy"});
}

TEST_F(Help, UnknownWords) {
  refuse(2, {"no command given", "render", "--help"}, {});
  refuse(2, {"'bake'", "info", "render", "trace"}, {"bake"});
  refuse(2, {"info: there is no option '--colour'; 'ballot info --help'"}, {"info", "--colour"});
  refuse(2, {"more.glb"}, {"info", "square.glb", "more.glb"});
  refuse(2, {"missing SCENE"}, {"render"});
  refuse(2, {"missing --rays"}, {"trace", "square.glb"});
  refuse(2, {"missing --out"}, {"trace", "square.glb", "--rays", "rays.npy"});
  refuse(2, {"--method needs a value"}, {"render", "square.glb", "--method"});
}

}  // namespace
}  // namespace ballot::test
