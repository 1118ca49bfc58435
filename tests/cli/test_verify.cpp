// Tests of `ballot verify`: its measurements, its verdicts, its output files and the arguments that it refuses.
#include <fstream>

#include "engine/answer/methods.h"
#include "engine/answer/numeric.h"
#include "engine/render/batch/ray_kinds.h"
#include "tests/cli/cli.h"
#include "tools/hard/hard.h"

namespace ballot::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kCornell = BALLOT_SOURCE_DIR "/scenes/cornell.gltf";

class Verify : public Cli {
 protected:
  void SetUp() override { square(); }

  Words words(const Words& more) const {
    Words args{"verify", "square.glb", "--repeat", "1", "--json", "verify.json"};
    args.insert(args.end(), more.begin(), more.end());
    return args;
  }

  /// Copies the shaders with one deliberate fault: the value that kernels write for a miss is not a miss to the host.
  /// Returns the environment that makes ballot use the copy.
  Environment faulty_shaders() const {
    fs::copy(BALLOT_SOURCE_DIR "/shaders", path("shaders"), fs::copy_options::recursive);
    std::string text = read("shaders/shared/layout.h");
    const std::string miss = "#define NO_HIT 0xFFFFFFFFu";
    const std::size_t place = text.find(miss);
    EXPECT_NE(place, std::string::npos);
    text.replace(place, miss.size(), "#define NO_HIT 0xFFFFFFFEu");
    write("shaders/shared/layout.h", text);
    return {{"BALLOT_SHADERS", path("shaders").string()}};
  }
};

/// Expects every field that a verified record must have.
void expect_contract(const nlohmann::json& record) {
  for (const char* key : {"false_misses", "false_hits", "wrong_prims", "ties", "wrong_values", "within_bound",
                          "beyond_bound", "unwritten", "self_hits"})
    EXPECT_TRUE(record.at(key).is_number_unsigned()) << key;
  for (const char* key : {"median", "p99", "max"}) EXPECT_TRUE(record.at("t_ulp").at(key).is_number()) << key;
  EXPECT_TRUE(record.at("cases").is_array());
}

TEST_F(Verify, CornellIsMeasuredHeldToTheOracleAndReported) {
  const Result result = succeed({"verify", kCornell, "--size", "32x32", "--repeat", "2", "--views", "view0", "--rays",
                                 "primary,ao", "--json", "verify.json"});
  expect_parts(result.out, {"cornell, primary", "cornell, ao", "beyond bound", "image RMSE", "watertight: none of"});
  const auto run = json("verify.json");
  std::set<std::string> methods, modes;
  for (const auto& record : run["records"]) {
    SCOPED_TRACE(record["label"]);
    methods.insert(record["method"]);
    modes.insert(record["numeric"]);
    expect_contract(record);
    EXPECT_EQ(record["verified_rays"], record["ray_count"]);
    EXPECT_GT(record["mrays_per_s"], 0);
    EXPECT_EQ(record["trace_ms"]["samples"].size(), 2u);
    EXPECT_EQ(record.contains("image_rmse"), record["rays"] == "primary");
    EXPECT_EQ(record["unwritten"], 0);
    if (record["numeric"] == "watertight") {
      EXPECT_EQ(record["beyond_bound"], 0);
      EXPECT_EQ(record["wrong_values"], 0);
    }
  }
  EXPECT_EQ(methods, (std::set<std::string>{std::string(kDefaultMethod), "packet"}));
  EXPECT_EQ(modes.size(), std::size(kNumericModes));
  expect_parts(report("tables verify.json"),
               {"## What a numeric mode costs", "wrong per million", "## Speed against error: ", "--rays primary,ao"});
}

TEST_F(Verify, OwnRaysNearestAndAny) {
  rays(100);
  succeed(words({"--rays", "rays.npy,rays.npy:any", "--methods", "if-if", "--numeric", "watertight"}));
  const auto run = json("verify.json");
  ASSERT_EQ(run["records"].size(), 2u);
  for (const auto& record : run["records"]) {
    expect_contract(record);
    EXPECT_EQ(record["verified_rays"], 100);
    EXPECT_EQ(record["false_misses"], 0);
    EXPECT_FALSE(record.contains("image_rmse"));
  }
  EXPECT_NE(run["records"][0]["any"], run["records"][1]["any"]);
}

TEST_F(Verify, AnswersBeyondTheBoundAreAFailureAndListed) {
  rays(100);
  std::uint64_t misses = 0;
  for (const Ray& ray : square_rays(100)) misses += !hits_square(ray);
  const Environment faulty = faulty_shaders();
  const Words measured = words({"--rays", "rays.npy", "--methods", "if-if", "--cases", "3", "--numeric"});
  Words promised = measured, free = measured, limited = measured;
  promised.emplace_back("watertight");
  free.emplace_back("plain");
  for (const char* word : {"plain", "--tolerance", "5"}) limited.emplace_back(word);
  const Result failed = run(promised, faulty);
  EXPECT_EQ(failed.code, 1);
  expect_parts(failed.err, {fmt::format("watertight: {} answers break what the mode promises", misses)});
  const auto record = json("verify.json")["records"][0];
  EXPECT_EQ(record["false_hits"], misses);
  EXPECT_EQ(record["beyond_bound"], misses);
  ASSERT_EQ(record["cases"].size(), 3u);
  const auto& first = record["cases"][0];
  EXPECT_EQ(first["kind"], "false hit");
  EXPECT_EQ(first["truth"]["prim"], NO_HIT);
  EXPECT_EQ(first["ray"].size(), 8u);
  EXPECT_NE(first["reason"], "");
  EXPECT_EQ(run(free, faulty).code, 0);
  const Result over = run(limited, faulty);
  EXPECT_EQ(over.code, 1);
  expect_parts(over.err, {"1 records have more than 5 wrong answers per million rays"});
  expect_parts(over.out, {fmt::format("plain: {} of 100 answers wrong", misses)});
}

// The device tests (HardCases) test that the hard cases hold. This test checks that the command reports them correctly.
TEST_F(Verify, HardCasesNeedNoScene) {
  const Result result = run(
      {"verify", "--hard", "--quick", "--methods", "while-while", "--numeric", "watertight", "--json", "verify.json"});
  expect_parts(result.out, {"hard case", "worst method", "leaks", "promise", "watertight: "});
  const auto run = json("verify.json");
  EXPECT_TRUE(run["records"].empty());
  std::set<std::string> names;
  std::uint64_t broken = 0;
  for (const auto& record : run["hard"]) {
    SCOPED_TRACE(record["case"]);
    names.insert(record["case"]);
    expect_contract(record);
    for (const char* key : {"leaks", "differing", "unlike_known", "beyond_bound", "wrong_values"})
      broken += record.at(key).get<std::uint64_t>();
    EXPECT_FALSE(record.contains("failed"));
  }
  EXPECT_EQ(names.size(), hard_cases().size());
  EXPECT_EQ(result.code, broken > 0 ? 1 : 0) << result.err;
  EXPECT_EQ(result.out.find("**broken**") != std::string::npos, broken > 0);
  expect_parts(report("tables verify.json"), {"## Hard cases", hard_cases()[0].name, hard_cases()[0].from});
}

TEST_F(Verify, BadArguments) {
  refuse(2, {"nothing to verify", "SCENE", "--hard"}, {"verify"});
  refuse(1, {"none.glb"}, {"verify", "none.glb"});
  refuse(2, {"--quick", "--hard"}, {"verify", "square.glb", "--quick"});
  refuse(2, {"--tolerance: -1"}, {"verify", "square.glb", "--tolerance", "-1"});
  refuse(2, {"'sloppy'", "plain", "watertight"}, {"verify", "square.glb", "--numeric", "sloppy"});
  refuse(2, {"'warp'", "packet"}, {"verify", "--hard", "--methods", "warp"});
  refuse(2, {"--repeat: 0"}, {"verify", "square.glb", "--repeat", "0"});
  refuse(2, {"no device is called 'abacus'"}, {"verify", "--hard", "--device", "abacus"});
  refuse(1, {"nowhere/v.json", "no folder nowhere"}, {"verify", "square.glb", "--json", "nowhere/v.json"});
}

TEST_F(Verify, HelpTeachesModesKindsAndExitCodes) {
  const std::string text = succeed({"verify", "--help-all"}).out;
  for (const Method& m : kMethods) expect_parts(text, {m.name, m.summary});
  for (const RayKind& kind : kRayKinds) expect_parts(text, {kind.name, kind.summary});
  for (const NumericMode& m : kNumericModes) expect_parts(text, {m.name, m.summary});
  expect_parts(text, {"--hard", "--quick", "--cases", "--tolerance", "FILE.npy", "--ao-rays", "Exit code 1", "Ctrl-C"});
}

}  // namespace
}  // namespace ballot::test
