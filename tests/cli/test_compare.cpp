// Tests of `ballot bench --compare`, which decides whether the second of two runs is slower beyond noise.
#include "tests/cli/bench_json.h"
#include "tests/cli/cli.h"

namespace ballot::test {
namespace {

class Compare : public Cli {
 protected:
  /// Writes a run with one record per view; `ms` gives the time of each view in milliseconds. Returns `name`.
  std::string run_of(const std::string& name, const std::vector<double>& ms, const std::string& label = "packet(any)",
                     std::uint64_t rays = 1000000) const {
    nlohmann::json run = made_up_run();
    for (std::size_t i = 0; i < ms.size(); ++i) {
      MadeUpRecord r{.view = "view" + std::to_string(i), .label = label, .ms = ms[i]};
      r.ray_count = rays;
      run["records"].push_back(made_up(r));
    }
    return write(name, run.dump());
  }
  Result compare(const Words& more = {}) const {
    Words args{"bench", "--compare", "a.json", "b.json"};
    args.insert(args.end(), more.begin(), more.end());
    return run(args);
  }
};

TEST_F(Compare, EqualRunsAreEqual) {
  run_of("a.json", {1, 2});
  run_of("b.json", {1, 2});
  const Result result = compare();
  EXPECT_EQ(result.code, 0) << result.out;
  EXPECT_EQ(result.err, "");
  expect_parts(result.out, {"sponza, primary, watertight", "1.000", "faster by more than 2 %: none",
                            "slower by more than 2 %: none"});
}

TEST_F(Compare, SlowerBeyondNoiseIsExitCode1) {
  run_of("a.json", {1, 2});
  run_of("b.json", {1.1, 2.2});
  const Result result = compare();
  EXPECT_EQ(result.code, 1);
  expect_parts(result.out,
               {"SLOWER", "\nslower by more than 2 %: 1", "  sponza, primary, packet(any), watertight: 1.100",
                "single views slower by more than 2 %, for information, with 95 % each: 2",
                "sponza, view1, primary, packet(any)"});
}

TEST_F(Compare, SingleViewsAreNamedButDoNotDecide) {
  run_of("a.json", {1, 1, 1, 1, 1});
  run_of("b.json", {1, 1, 1, 1, 1.08});
  const Result result = compare();
  EXPECT_EQ(result.code, 0) << result.out;
  expect_parts(result.out, {"\nslower by more than 2 %: none",
                            "single views slower by more than 2 %, for information, with 95 % each: 1",
                            "sponza, view4, primary, packet(any), watertight: 1.080"});
}

TEST_F(Compare, IntervalsWidenWithTheNumberOfGroups) {
  for (const char* name : {"a.json", "b.json"}) {
    nlohmann::json run = made_up_run();
    for (int i = 0; i < 100; ++i) run["records"].push_back(made_up({.label = "cut(" + std::to_string(i) + ")"}));
    write(name, run.dump());
  }
  EXPECT_EQ(compare({"--json", "many.json"}).code, 0);
  run_of("a.json", {1});
  run_of("b.json", {1});
  EXPECT_EQ(compare({"--json", "one.json"}).code, 0);
  const auto many = json("many.json"), one = json("one.json");
  EXPECT_NEAR(one["confidence"].get<double>(), 0.95, 1e-12);
  EXPECT_NEAR(many["confidence"].get<double>(), 0.9995, 1e-12);
  const auto width = [](const nlohmann::json& c) { return c["high"].get<double>() - c["low"].get<double>(); };
  EXPECT_GT(width(many["groups"][0]), 1.3 * width(one["groups"][0]));
  EXPECT_LT(width(many["records"][0]), 1.2 * width(one["records"][0]));
}

TEST_F(Compare, LikeSettingsAreCompared) {
  nlohmann::json gpu = made_up_run(), cpu = made_up_run("llvmpipe (LLVM 15, 256 bits)");
  gpu["records"].push_back(made_up({.ms = 1}));
  cpu["records"].push_back(made_up({.ms = 40}));
  nlohmann::json a{{"documents", {gpu, cpu}}}, b{{"documents", {cpu, gpu}}};
  write("a.json", a.dump());
  write("b.json", b.dump());
  Result result = compare({"--json", "c.json"});
  EXPECT_EQ(result.code, 0) << result.out;
  EXPECT_EQ(json("c.json")["groups"].size(), 2u);
  expect_parts(result.out, {"llvmpipe (LLVM 15, 256 bits), imagined 1.0, subgroups of 32, 1024x1024", "Imagined GPU"});
  b["documents"][1]["records"][0] = made_up({.ms = 2});
  write("b.json", b.dump());
  result = compare();
  EXPECT_EQ(result.code, 1);
  expect_parts(result.out,
               {"\nslower by more than 2 %: 1", "GPU timestamps: sponza, primary, packet(any), watertight: 2.000"});
  gpu["size"] = {64, 64};
  write("b.json", gpu.dump());
  refuse(1, {"no record in common", "device, driver, size"}, {"bench", "--compare", "a.json", "b.json"});
}

TEST_F(Compare, CompilersOfCpuDevicesAreNotedAndPartialRunsWarnedOf) {
  nlohmann::json run = made_up_run("llvmpipe (LLVM 15, 256 bits)");
  run["records"].push_back(made_up({}));
  write("a.json", run.dump());
  run["partial"] = true;
  write("b.json", run.dump());
  const Result result = compare();
  EXPECT_EQ(result.code, 0);
  expect_parts(result.out, {"up to 40 % between two compiles", "compare several runs"});
  expect_parts(result.err, {"ballot: warning: B (b.json, llvmpipe", "is partial"});
  run_of("a.json", {1});
  write("b.json", read("a.json"));
  EXPECT_EQ(compare().out.find("40 %"), std::string::npos);
}

TEST_F(Compare, FasterIsFine) {
  run_of("a.json", {1, 2});
  run_of("b.json", {0.8, 1.6});
  const Result result = compare();
  EXPECT_EQ(result.code, 0);
  expect_parts(result.out, {"\nfaster by more than 2 %: 1", "0.800"});
}

TEST_F(Compare, ToleranceDecides) {
  run_of("a.json", {1});
  run_of("b.json", {1.1});
  EXPECT_EQ(compare({"--tolerance", "0.2"}).code, 0);
  EXPECT_EQ(compare({"--tolerance", "0"}).code, 1);
  refuse(2, {"--tolerance: -1"}, {"bench", "--compare", "a.json", "b.json", "--tolerance", "-1"});
}

TEST_F(Compare, NoiseIsNoRegression) {
  nlohmann::json a = made_up_run(), b = made_up_run();
  a["records"].push_back(made_up({.ms = 1}));
  b["records"].push_back(made_up({.ms = 1}));
  for (int i = 0; i < 21; ++i) b["records"][0]["trace_ms"]["samples"][i] = i % 2 ? 0.8 : 1.4;
  b["records"][0]["trace_ms"]["median"] = 1.4;
  write("a.json", a.dump());
  write("b.json", b.dump());
  const Result result = compare();
  EXPECT_EQ(result.code, 0) << result.out;
  expect_parts(result.out, {"1.400"});
}

TEST_F(Compare, RunsTwiceTheSame) {
  run_of("a.json", {1, 2});
  run_of("b.json", {1.01, 2.03});
  EXPECT_EQ(compare().out, compare().out);
}

TEST_F(Compare, TimesArePerRay) {
  run_of("a.json", {1}, "packet(any)", 1000000);
  run_of("b.json", {2}, "packet(any)", 2000000);
  EXPECT_EQ(compare().code, 0);
}

TEST_F(Compare, RecordsOfOneSideAreNamed) {
  run_of("a.json", {1, 2, 3});
  run_of("b.json", {1, 2});
  const Result result = compare();
  EXPECT_EQ(result.code, 0);
  expect_parts(result.out, {"only in A: 1 records", "sponza, view2, primary, packet(any), watertight"});
}

TEST_F(Compare, NothingInCommon) {
  run_of("a.json", {1});
  run_of("b.json", {1}, "if-if");
  refuse(1, {"a.json and b.json have no record in common", "1 and 1 records"},
         {"bench", "--compare", "a.json", "b.json"});
}

TEST_F(Compare, OtherDevicesAreAWarning) {
  run_of("a.json", {1});
  nlohmann::json b = made_up_run("Another GPU");
  b["records"].push_back(made_up({}));
  write("b.json", b.dump());
  const Result result = compare();
  EXPECT_EQ(result.code, 0);
  expect_parts(result.err, {"ballot: warning: the devices differ: Imagined GPU and Another GPU"});
}

TEST_F(Compare, OtherAoRaysAreAWarning) {
  run_of("a.json", {1});
  nlohmann::json b = made_up_run();
  b["ao_rays"] = 4;
  b["records"].push_back(made_up({}));
  write("b.json", b.dump());
  expect_parts(compare().err, {"ballot: warning: the number or length of ao rays differ: 8 ao rays of 0.05 and 4"});
}

TEST_F(Compare, SweepsAreLeftOut) {
  nlohmann::json a = made_up_bench(), b = made_up_bench();
  for (auto& record : b["records"])
    if (record["role"] == "sweep") record["trace_ms"] = made_up_times(99);
  write("a.json", a.dump());
  write("b.json", b.dump());
  EXPECT_EQ(compare().code, 0);
}

TEST_F(Compare, FewSamplesAreNotJudged) {
  nlohmann::json a = made_up_run(), b = made_up_run();
  a["records"].push_back(made_up({}));
  for (const std::size_t samples : {0, 1, 5, 6}) {
    SCOPED_TRACE(samples);
    b["records"] = {made_up({.ms = 2})};
    auto& times = b["records"][0]["trace_ms"]["samples"];
    while (times.size() > samples) times.erase(times.size() - 1);
    write("a.json", a.dump());
    write("b.json", b.dump());
    const Result result = compare();
    EXPECT_EQ(result.code, samples < 6 ? 0 : 1);
    expect_parts(result.out, {"2.000"});
    if (samples < 6) expect_parts(result.out, {"too few samples", "1 groups have too few samples"});
  }
}

TEST_F(Compare, WritesJson) {
  run_of("a.json", {1});
  run_of("b.json", {1.5});
  EXPECT_EQ(compare({"--json", "c.json"}).code, 1);
  const auto all = json("c.json");
  EXPECT_EQ(all["groups"].size(), 1u);
  EXPECT_NEAR(all["groups"][0]["ratio"].get<double>(), 1.5, 1e-9);
  EXPECT_EQ(all["groups"][0]["slower"], true);
}

TEST_F(Compare, BadFiles) {
  run_of("a.json", {1});
  refuse(1, {"b.json", "No such file"}, {"bench", "--compare", "a.json", "b.json"});
  write("b.json", "# not JSON");
  refuse(1, {"b.json: expected JSON as 'ballot bench --json' writes it"}, {"bench", "--compare", "a.json", "b.json"});
  write("b.json", "{\"triangles\": 3}");
  refuse(1, {"b.json: top level: expected an object with 'device'"}, {"bench", "--compare", "a.json", "b.json"});
  refuse(2, {"--compare a.json: needs two files, the older run's and the newer one's"},
         {"bench", "--compare", "a.json"});
  refuse(2, {"measures nothing", "leave out --report"}, {"bench", "--compare", "a.json", "a.json", "--report", "out"});
  refuse(2, {"leave out SCENE"}, {"bench", "square.glb", "--compare", "a.json", "a.json"});
  refuse(2, {"--methods", "--sweep", "--device"},
         {"bench", "--compare", "a.json", "a.json", "--methods", "packet", "--sweep", "--device", "cpu"});
}

}  // namespace
}  // namespace ballot::test
