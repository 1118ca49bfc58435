// Tests of `ballot verify`: its measurements, its verdicts, its output files and the arguments that it refuses.
#include <fstream>

#include "engine/render/batch/ray_kinds.h"
#include "engine/trace/methods.h"
#include "engine/trace/numeric.h"
#include "tests/cli/bench_json.h"
#include "tests/cli/cli.h"
#include "tests/cpu/needs.h"
#include "tools/hard/hard.h"

namespace ballot::test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kCornell = BALLOT_SOURCE_DIR "/scenes/cornell.gltf";
const Environment kNoPython{{"BALLOT_PYTHON", "/nowhere"}};

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

  /// Returns an invented verified run: mode fast has wrong answers; watertight has none and takes a quarter more time.
  static nlohmann::json made_up_verify(const std::string& device) {
    nlohmann::json run = made_up_run(device);
    for (const char* numeric : {"fast", "watertight"}) {
      const bool fast = std::string(numeric) == "fast";
      nlohmann::json record = made_up({.label = "while-while", .method = "while-while", .ms = fast ? 1.0 : 1.25});
      record["numeric"] = numeric;
      record["verified_rays"] = 1000000;
      for (const char* count : {"ties", "wrong_values", "within_bound", "unwritten", "self_hits", "false_hits"})
        record[count] = 0;
      record["false_misses"] = fast ? 12 : 0;
      record["wrong_prims"] = fast ? 8 : 0;
      record["beyond_bound"] = fast ? 3 : 0;
      record["t_ulp"] = {{"median", 0.5}, {"p99", 3}, {"max", 17}};
      record["cases"] = nlohmann::json::array();
      run["records"].push_back(record);
    }
    return run;
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
                                 "primary,ao", "--json", "verify.json", "--report", "out"},
                                kNoPython);
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
  EXPECT_EQ(json("out/verify.json"), run);
  const std::string csv = read("out/verify.csv");
  EXPECT_EQ(std::size_t(std::count(csv.begin(), csv.end(), '\n')), run["records"].size() + 1);
  expect_parts(read("out/verify.md"), {"# Speed against error", "## What a mode costs", "## Wrong answers per million",
                                       "## Speed against error: ", "--rays primary,ao", "no plots"});
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
  const Result result = run({"verify", "--hard", "--quick", "--methods", "while-while", "--numeric", "watertight",
                             "--json", "verify.json", "--report", "out"});
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
  expect_parts(read("out/verify.md"), {"## Hard cases", std::string(hard_cases()[0].what)});
  expect_parts(read("out/verify.csv"), {"hard/" + std::string(hard_cases()[0].name)});
  write("README.md", "<!-- accuracy:begin -->\n<!-- accuracy:end -->\n");
  succeed({"report", "verify.json", "--readme", "README.md"});
  expect_parts(read("README.md"), {"### Hard cases", std::string(hard_cases()[0].name)});
}

TEST_F(Verify, ReportsStandSideBySideInAReadme) {
  write("gpu.json", made_up_verify("Imagined GPU").dump());
  write("cpu.json", made_up_verify("Imagined CPU").dump());
  write("bench.json", made_up_bench().dump());
  write("README.md",
        "above\n<!-- results:begin -->\n<!-- results:end -->\n<!-- accuracy:begin -->\nto be replaced\n<!-- "
        "accuracy:end -->\nend");
  succeed({"report", "gpu.json", "cpu.json", "bench.json", "--readme", "README.md", "--report", "out"}, kNoPython);
  const std::string text = read("README.md");
  EXPECT_EQ(text.find("to be replaced"), std::string::npos);
  EXPECT_TRUE(text.starts_with("above\n") && text.ends_with("<!-- accuracy:end -->\nend"));
  expect_parts(text,
               {"### What a mode costs", "Imagined GPU: fast", "Imagined CPU: watertight", "+25.0 %", "20.0 (3.0)",
                "fast: 20 of 1.0 million answers wrong (20.0 per million), 3 beyond the bound of its arithmetic",
                "watertight: none of 1.0 million answers wrong", "### Table 2"});
  for (const char* file : {"out/verify.md", "out/report.md", "out/verify.json", "out/results.json"})
    EXPECT_TRUE(files().contains(file)) << file;
  EXPECT_EQ(json("out/verify.json")["documents"].size(), 2u);
  succeed({"report", "out/verify.json", "--report", "again"}, kNoPython);
  EXPECT_EQ(read("again/verify.json"), read("out/verify.json"));
  EXPECT_EQ(read("again/verify.csv"), read("out/verify.csv"));
}

TEST_F(Verify, DrawsAPlot) {
  write("gpu.json", made_up_verify("Imagined GPU").dump());
  const Result result = succeed({"report", "gpu.json", "--report", "out"});
  // Without matplotlib, standard error says that it is missing.
  BALLOT_NEEDS(result.err.find("no plots") == std::string::npos, result.err);
  for (const char* plot : {"out/accuracy-1.svg", "out/accuracy-1.png"}) EXPECT_TRUE(files().contains(plot)) << plot;
  expect_parts(read("out/verify.md"), {"![accuracy-1](accuracy-1.svg)"});
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
  refuse(1, {"--report square.glb"}, {"verify", "square.glb", "--report", "square.glb"});
  refuse(1, {"nowhere/v.json", "no folder nowhere"}, {"verify", "square.glb", "--json", "nowhere/v.json"});
  write("README.md", "no markers\n");
  refuse(1, {"README.md", "found 0 lines '<!-- accuracy:begin -->'", "mark the place for the accuracy"},
         {"verify", "square.glb", "--readme", "README.md"});
  nlohmann::json wrong = made_up_verify("Imagined GPU");
  wrong["records"][0]["ties"] = -1;
  write("wrong.json", wrong.dump());
  refuse(1, {"wrong.json", "records[0].ties", "0 or more", "-1"}, {"report", "wrong.json", "--report", "out"});
}

TEST_F(Verify, HelpTeachesModesKindsAndExitCodes) {
  const std::string text = succeed({"verify", "--help-all"}).out;
  for (const Method& m : kMethods) expect_parts(text, {m.name, m.summary});
  for (const RayKind& kind : kRayKinds) expect_parts(text, {kind.name, kind.summary});
  for (const NumericMode& m : kNumericModes) expect_parts(text, {m.name, m.summary});
  expect_parts(text, {"--hard", "--quick", "--cases", "--tolerance", "--report", "--readme", "FILE.npy", "--ao-rays",
                      "Exit code 1", "Ctrl-C"});
}

}  // namespace
}  // namespace ballot::test
