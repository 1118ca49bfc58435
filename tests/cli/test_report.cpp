// Tests of `ballot report`, which turns JSON of bench runs into tables, answers and plots.
#include <sstream>

#include "tests/cli/bench_json.h"
#include "tests/cli/cli.h"
#include "tests/cpu/needs.h"

namespace ballot::test {
namespace {

class Report : public Cli {
 protected:
  std::string write_json(const std::string& name, const nlohmann::json& json) const { return write(name, json.dump()); }

  /// Returns the cells of the first table row after `heading` whose first cell begins with `first`.
  Words row(const std::string& text, const std::string& heading, const std::string& first) const {
    std::istringstream lines(text.substr(std::min(text.find(heading), text.size())));
    for (std::string line; std::getline(lines, line);) {
      if (!line.starts_with("| " + first + " ")) continue;
      Words cells;
      std::istringstream parts(line.substr(1));
      for (std::string cell; std::getline(parts, cell, '|');) {
        const std::size_t begin = cell.find_first_not_of(' '), end = cell.find_last_not_of(' ');
        cells.push_back(begin == std::string::npos ? "" : cell.substr(begin, end - begin + 1));
      }
      return cells;
    }
    ADD_FAILURE() << "found no table row that begins with " << first << " after " << heading << " in:\n" << text;
    return {};
  }

  /// Returns an environment in which Python finds no matplotlib.
  const Environment no_matplotlib() const {
    std::filesystem::create_directories(path("fake/matplotlib"));
    write("fake/matplotlib/__init__.py", "raise ImportError('No module named matplotlib')\n");
    return {{"PYTHONPATH", path("fake").string()}, {"PYTHONDONTWRITEBYTECODE", "1"}};
  }
};

TEST_F(Report, WritesTablesAndAnswers) {
  write_json("a.json", made_up_bench());
  succeed({"report", "a.json", "--report", "out"}, no_matplotlib());
  const std::string text = read("out/report.md");
  expect_parts(text, {"Imagined GPU", "imagined 1.0", "subgroups of 32", "GPU timestamps", "1024 x 1024", "21 repeats",
                      "0123456789ab", "ballot bench sponza.glb --report out"});
  EXPECT_EQ(row(text, "## Table 1", "Sponza"),
            (Words{"Sponza", "76k", "76154", "114k", "114231", "52k", "52001", "25", "60.5", "1.9"}));
  EXPECT_EQ(row(text, "## Table 2", "packet"), (Words{"packet", "47.46 (0%)", "500.0 (+0.0 %)"}));
  EXPECT_EQ(row(text, "## Table 2", "if-if"), (Words{"if-if", "47.80 (+0.72%)", "444.4 (-11.1 %)"}));
  EXPECT_EQ(row(text, "## Table 2", "stack-max(11)"), (Words{"stack-max(11)", "47.40 (-0.13%)", "-"}));
  EXPECT_EQ(row(text, "## Table 2", "cut(best, count)"), (Words{"cut(best, count)", "", "666.7 (+33.3 %)"}));
  EXPECT_EQ(row(text, "## Table 2", "packet(sum)"), (Words{"packet(sum)", "", "333.3 (-33.3 %)"}));
  EXPECT_EQ(row(text, "## Mrays/s, trace alone", "packet(count)"), (Words{"packet(count)", "1250"}));
  EXPECT_EQ(row(text, "## Mrays/s, trace alone", "cut(best)"), (Words{"cut(best)", "**2000**"}));
  EXPECT_EQ(row(text, "## Speed by vote", "packet"), (Words{"packet", "primary", "1.250", "0.500", "2.500"}));
  EXPECT_EQ(row(text, "## Time over the best", "if-if"), (Words{"if-if", "2.50", "sponza, primary", "2.50", "2"}));
  EXPECT_EQ(row(text, "## Mrays/s by threshold", "0.5"), (Words{"0.5", "**2000**"}));
  expect_parts(text, {"packet(any) is faster than if-if: +25.0 % (sponza, primary); it wins 1 of 1 scenes",
                      "count is faster than any: +25.0 %", "sum is slower than any: -50.0 %",
                      "cut(best), with the instruction that the paper asked for, beat packet and if-if? It beats both "
                      "in 2 of 2 cases",
                      "never far from the best? packet(count): at most 1.60 times"});
}

TEST_F(Report, WithoutMatplotlibSaysWhatToInstallAndType) {
  write_json("a.json", made_up_bench());
  const Result result = succeed({"report", "a.json", "--report", "out"}, no_matplotlib());
  for (const std::string& text : {result.err, read("out/report.md")})
    expect_parts(text, {"no plots", "python3-matplotlib", "plot_bench.py out/results.json --out out"});
  EXPECT_EQ(read("out/report.md").find(".svg"), std::string::npos);
  for (const char* file : {"out/results.json", "out/records.csv", "out/report.md"}) EXPECT_TRUE(files().contains(file));
}

TEST_F(Report, WithoutPythonToo) {
  write_json("a.json", made_up_bench());
  const Result result = succeed({"report", "a.json", "--report", "out"}, {{"BALLOT_PYTHON", "/nowhere/python3"}});
  expect_parts(result.err, {"no plots", "Python 3 is missing", "python3-matplotlib"});
}

TEST_F(Report, DrawsPlots) {
  write_json("a.json", made_up_bench());
  const Result result = succeed({"report", "a.json", "--report", "out"});
  // Without matplotlib, standard error says that it is missing.
  BALLOT_NEEDS(result.err.find("no plots") == std::string::npos, result.err);
  for (const char* plot : {"out/speedup-1.svg", "out/threshold-1-f.svg", "out/speedup-1.png"})
    EXPECT_TRUE(files().contains(plot)) << plot;
  expect_parts(read("out/report.md"), {"![speedup-1](speedup-1.svg)", "![threshold-1-f](threshold-1-f.svg)"});
  expect_parts(read("out/speedup-1.svg"), {"<svg"});
}

TEST_F(Report, SeveralDevicesStandBesideEachOther) {
  write_json("a.json", made_up_bench());
  write_json("b.json", made_up_bench("Imagined CPU"));
  succeed({"report", "a.json", "b.json", "--report", "out"}, no_matplotlib());
  expect_parts(read("out/report.md"), {"## Table 2: frames per second and speed-up against packet: Imagined GPU",
                                       "## Table 2: frames per second and speed-up against packet: Imagined CPU"});
  EXPECT_EQ(json("out/results.json")["documents"].size(), 2u);
  succeed({"report", "out/results.json", "--report", "again"}, no_matplotlib());
  EXPECT_EQ(read("again/results.json"), read("out/results.json"));
  EXPECT_EQ(read("again/records.csv"), read("out/records.csv"));
}

TEST_F(Report, ThePapersCutIsOursBySum) {
  nlohmann::json run = made_up_bench();
  for (const char* view : {"view0", "view1"}) {
    run["records"].push_back(made_up({.view = view, .label = "cut", .method = "cut", .ms = 1}));
    run["records"].push_back(made_up({.view = view, .label = "cut(sum)", .method = "cut", .ms = 3}));
  }
  write_json("a.json", run);
  succeed({"report", "a.json", "--report", "out"}, no_matplotlib());
  const std::string text = read("out/report.md");
  EXPECT_EQ(row(text, "## Table 2", "cut"), (Words{"cut", "42.28 (-10.91%)", "250.0 (-50.0 %)"}));
  EXPECT_EQ(row(text, "## Table 2", "cut(count)"), (Words{"cut(count)", "", "500.0 (+0.0 %)"}));
  EXPECT_EQ(text.find("| cut(sum) ", text.find("## Table 2")), text.find("| cut(sum) ", text.find("## Mrays/s")));
  EXPECT_EQ(row(text, "## Mrays/s", "cut").front(), "cut");
  expect_parts(text, {"The paper's cut votes by a reduction in shared memory: its row shows cut(sum)"});
}

TEST_F(Report, WhatStandsInForARowOfThePaperIsShownOnce) {
  nlohmann::json gpu = made_up_run(), cpu = made_up_run("Imagined CPU");
  for (nlohmann::json* run : {&gpu, &cpu}) {
    run->at("records").push_back(made_up({}));
    run->at("records").push_back(made_up({.label = "cut", .method = "cut", .ms = 3}));
  }
  gpu["records"].push_back(made_up({.label = "cut(sum)", .method = "cut", .ms = 9}));
  gpu["records"].push_back(made_up({.label = "stack-max(11)", .method = "stack-max", .ms = 4}));
  cpu["records"].push_back(made_up({.label = "stack-max(11,count)", .method = "stack-max", .ms = 7}));
  write_json("a.json", gpu);
  write_json("b.json", cpu);
  write("README.md", "<!-- results:begin -->\n<!-- results:end -->\n");
  succeed({"report", "a.json", "b.json", "--readme", "README.md", "--report", "out"}, no_matplotlib());
  const std::string text = read("README.md");
  EXPECT_EQ(row(text, "## Table 2", "cut"), (Words{"cut", "42.28 (-10.91%)", "100.0 (-80.0 %)", "250.0 (-50.0 %)"}));
  EXPECT_EQ(row(text, "## Table 2", "cut(count)"), (Words{"cut(count)", "", "250.0 (-50.0 %)", "above"}));
  EXPECT_EQ(row(text, "## Table 2", "stack-max(11)"),
            (Words{"stack-max(11)", "47.40 (-0.13%)", "200.0 (-60.0 %)", "125.0 (-75.0 %)"}));
  EXPECT_EQ(row(text, "## How far", "stack-max(11)"), (Words{"stack-max(11)", "4.00, 4.00", "7.00, 7.00"}));
  EXPECT_EQ(text.find("| stack-max(11,count)"), std::string::npos);
  expect_parts(text, {"those by `count` stand in"});
  // Each table of the report shows one setting, so rows that stood in for others are not shown again.
  const std::string report = read("out/report.md");
  const std::size_t of_cpu = report.find("## Table 2: frames per second and speed-up against packet: Imagined CPU");
  EXPECT_GT(report.find("| cut(count)", of_cpu), report.find("## Mrays/s"));
}

TEST_F(Report, ColumnsOfOneDeviceAreNamedBySetting) {
  nlohmann::json run = made_up_run();
  run["records"].push_back(made_up({.scene = "fairyforest-standin"}));
  run["records"].push_back(made_up({.scene = "fairyforest-standin", .ms = 3}));
  run["records"][1]["numeric"] = "plain";
  write_json("a.json", run);
  write("README.md", "<!-- results:begin -->\n<!-- results:end -->\n");
  succeed({"report", "a.json", "--readme", "README.md"});
  expect_parts(read("README.md"), {"Fairy (stand-in), Imagined GPU, watertight",
                                   "Fairy (stand-in), Imagined GPU, plain", "was not at hand"});
}

TEST_F(Report, EntriesThatLackViewsAreNotTheBest) {
  nlohmann::json run = made_up_run();
  run["partial"] = true;
  run["records"].push_back(made_up({.view = "view0"}));
  run["records"].push_back(made_up({.view = "view1"}));
  run["records"].push_back(made_up({.view = "view0", .label = "if-if", .method = "if-if", .ms = 0.1}));
  run["records"].push_back(made_up({.view = "view0", .label = "while-while", .method = "while-while", .ms = 2}));
  run["records"].push_back(made_up({.view = "view1", .label = "while-while", .method = "while-while", .ms = 2}));
  write_json("a.json", run);
  succeed({"report", "a.json", "--report", "out"}, no_matplotlib());
  const std::string text = read("out/report.md");
  EXPECT_EQ(row(text, "## Mrays/s, trace", "packet(any)"), (Words{"packet(any)", "**1000**"}));
  EXPECT_EQ(row(text, "## Mrays/s, trace", "if-if"), (Words{"if-if", "10000"}));
  EXPECT_EQ(row(text, "## Time over the best", "while-while"),
            (Words{"while-while", "2.00", "sponza, primary", "2.00", "1"}));
  EXPECT_EQ(text.find("| if-if", text.find("## Time over the best")), std::string::npos);
}

TEST_F(Report, TheLaterOfTwoMeasurementsCounts) {
  nlohmann::json slow = made_up_run(), fast = made_up_run();
  slow["records"].push_back(made_up({.ms = 2}));
  fast["records"].push_back(made_up({.ms = 1}));
  write_json("slow.json", slow);
  write_json("fast.json", fast);
  succeed({"report", "slow.json", "fast.json", "--report", "out"}, no_matplotlib());
  expect_parts(read("out/report.md"), {"1 records were measured twice"});
  EXPECT_EQ(row(read("out/report.md"), "## Mrays/s", "packet(any)"), (Words{"packet(any)", "**1000**"}));
}

TEST_F(Report, CountersAndChecks) {
  nlohmann::json run = made_up_bench();
  run["records"][0]["counters"] = {{"nodes", 40.0}, {"nodes_needed", 30.0}};
  run["records"][0]["check"] = {{"rays", 1000},    {"same", 990},      {"tie", 7},     {"false_misses", 2},
                                {"false_hits", 0}, {"wrong_prims", 1}, {"wrong_t", 0}, {"unwritten", 0}};
  write_json("a.json", run);
  succeed({"report", "a.json", "--report", "out"}, no_matplotlib());
  EXPECT_EQ(row(read("out/report.md"), "## Counters", "sponza"),
            (Words{"sponza", "primary", "packet(any)", "40.00", "30.00"}));
  expect_parts(read("out/report.md"), {"1000 rays compared, 3 errors"});
  expect_parts(read("out/records.csv"), {"counter_nodes,counter_nodes_needed", ",1000,990,7,2,0,1,0,0,40,30\r\n"});
}

TEST_F(Report, CountersOfViewsArePooled) {
  nlohmann::json run = made_up_run();
  run["records"].push_back(made_up({.view = "view0"}));
  run["records"].push_back(made_up({.view = "view1", .ray_count = 3000000}));
  run["records"][0]["counters"] = {
      {"nodes", 64.0},        {"nodes_needed", 30.0}, {"leaves_needed", 2.0}, {"steps", 2.0},    {"active_share", 0.5},
      {"packet_nodes", 64.0}, {"packet_share", 1.0},  {"few", 0.5},           {"unneeded", 0.0}, {"votes", 2.0},
      {"disagreements", 1.0}, {"switches", 0.0},      {"switch_depth", 0.0},  {"stack_max", 7.0}};
  run["records"][1]["counters"] = {
      {"nodes", 32.0},        {"nodes_needed", 7.0}, {"leaves_needed", 1.0}, {"steps", 1.0},     {"active_share", 0.25},
      {"packet_nodes", 0.0},  {"packet_share", 0.0}, {"few", 0.0},           {"unneeded", 0.25}, {"votes", 0.0},
      {"disagreements", 0.0}, {"switches", 0.5},     {"switch_depth", 4.0},  {"stack_max", 5.0}};
  write_json("a.json", run);
  succeed({"report", "a.json", "--report", "out"}, no_matplotlib());
  const std::string text = read("out/report.md");
  const Words names = row(text, "## Counters", "scene"), values = row(text, "## Counters", "sponza");
  ASSERT_EQ(names.size(), values.size());
  std::map<std::string, std::string> found;
  for (std::size_t i = 0; i < names.size(); ++i) found[names[i]] = values[i];
  EXPECT_EQ(found["nodes"], "40.00");                           // (64 + 3 * 32) / 4
  EXPECT_EQ(found["active_share"], "0.3500");                   // (32 + 3 * 8) / (32 * (2 + 3 * 1))
  EXPECT_EQ(found["packet_share"], "0.4000");                   // 64 / (64 + 3 * 32)
  EXPECT_EQ(found["few / packet node visits"], "0.2500");       // 0.5 / (64 / 32)
  EXPECT_EQ(found["unneeded / packet node visits"], "0.3750");  // 3 * 0.25 / (64 / 32)
  EXPECT_EQ(found["disagreements / votes"], "0.5000");
  EXPECT_EQ(found["mean depth of a switch"], "8.000");
  EXPECT_EQ(found["stack_max"], "7.000");
}

TEST_F(Report, EnvironmentStandsBeforeTheCommand) {
  nlohmann::json run = made_up_bench();
  run["environment"] = {{"VK_DRIVER_FILES", "/tmp/my icd.json"}, {"LP_NATIVE_VECTOR_WIDTH", "128"}};
  write_json("a.json", run);
  succeed({"report", "a.json", "--report", "out"}, no_matplotlib());
  expect_parts(read("out/report.md"),
               {"LP_NATIVE_VECTOR_WIDTH=128 VK_DRIVER_FILES='/tmp/my icd.json' ballot bench sponza.glb"});
  EXPECT_EQ(json("out/results.json")["environment"], run["environment"]);
}

TEST_F(Report, NamesFromFilesBreakNeitherCsvNorTables) {
  nlohmann::json run = made_up_run("GPU, the \"best\"");
  run["records"].push_back(made_up({.scene = "a|b\nc"}));
  write_json("a.json", run);
  succeed({"report", "a.json", "--report", "out"}, no_matplotlib());
  expect_parts(read("out/records.csv"), {"\"GPU, the \"\"best\"\"\",imagined 1.0,", ",\"a|b\nc\",view0,"});
  expect_parts(read("out/report.md"), {"a\\|b c"});
}

TEST_F(Report, StandInIsCalledOne) {
  nlohmann::json run = made_up_run();
  run["records"].push_back(made_up({.scene = "fairyforest-standin"}));
  write_json("a.json", run);
  succeed({"report", "a.json", "--report", "out"}, no_matplotlib());
  expect_parts(read("out/report.md"), {"Fairy, paper", "Fairy (stand-in), here", "60.44 (0%)", "was not at hand"});
}

TEST_F(Report, ReadmeBetweenItsMarkers) {
  write_json("a.json", made_up_bench());
  write("README.md", "# Title\n\n<!-- results:begin -->\nstale text\n<!-- results:end -->\n\nlast\n");
  succeed({"report", "a.json", "--readme", "README.md"});
  const std::string once = read("README.md");
  EXPECT_TRUE(once.starts_with("# Title\n\n<!-- results:begin -->\n\n### What was measured\n")) << once;
  EXPECT_TRUE(once.ends_with("\n<!-- results:end -->\n\nlast\n")) << once;
  EXPECT_EQ(once.find("stale text"), std::string::npos);
  expect_parts(once, {"### Answers", "### Table 2"});
  succeed({"report", "a.json", "--readme", "README.md"});
  EXPECT_EQ(read("README.md"), once);
}

TEST_F(Report, ReadmeWithoutItsMarkers) {
  write_json("a.json", made_up_bench());
  const Words args{"report", "a.json", "--readme", "README.md"};
  refuse(1, {"README.md", "No such file"}, args);
  write("README.md", "# Title\n");
  refuse(1, {"README.md", "found 0 lines '<!-- results:begin -->'"}, args);
  write("README.md", "<!-- results:begin -->\n");
  refuse(1, {"README.md", "found 0 lines '<!-- results:end -->'"}, args);
  write("README.md", "<!-- results:end -->\n<!-- results:begin -->\n");
  refuse(1, {"README.md", "found '<!-- results:end -->' before"}, args);
  write("README.md", "<!-- results:begin -->\n<!-- results:begin -->\n<!-- results:end -->\n");
  refuse(1, {"README.md", "found 2 lines"}, args);
  EXPECT_EQ(read("README.md"), "<!-- results:begin -->\n<!-- results:begin -->\n<!-- results:end -->\n");
}

TEST_F(Report, BadFiles) {
  const Words args{"report", "a.json", "--report", "out"};
  refuse(2, {"--report DIR", "--readme"}, {"report", "a.json"});
  refuse(2, {"missing FILES"}, {"report", "--report", "out"});
  refuse(1, {"a.json", "No such file"}, args);
  write("a.json", "");
  refuse(1, {"a.json: expected JSON", "byte 1 of 0"}, args);
  write("a.json", "{\"device\": ");
  refuse(1, {"a.json: expected JSON"}, args);
  write("a.json", "[1, 2]");
  refuse(1, {"a.json: top level: expected an object", "found [1,2]", "'ballot bench --json'"}, args);
  write("a.json", "{\"documents\": []}");
  refuse(1, {"a.json: documents: expected at least one"}, args);
  nlohmann::json run = made_up_bench();
  run["records"][1]["trace_ms"] = 3;
  write_json("a.json", run);
  refuse(1, {"a.json: records[1].trace_ms: expected an object", "found 3"}, args);
  run = made_up_bench();
  run["records"][0]["trace_ms"]["median"] = 0;
  write_json("a.json", run);
  refuse(1, {"records[0].trace_ms.median: expected a number above 0, found 0"}, args);
  run = made_up_bench();
  run["records"][0].erase("label");
  write_json("a.json", run);
  refuse(1, {"records[0]: expected an object with 'label'"}, args);
  run = made_up_bench();
  run["records"][0]["role"] = "king";
  write_json("a.json", run);
  refuse(1, {"records[0].role: expected 'method', 'sweep' or 'best', found \"king\""}, args);
}

TEST_F(Report, BadFolders) {
  write_json("a.json", made_up_bench());
  write("file", "precious");
  refuse(1, {"--report file"}, {"report", "a.json", "--report", "file"});
  refuse(1, {"--report file/below"}, {"report", "a.json", "--report", "file/below"});
}

}  // namespace
}  // namespace ballot::test
