// ballot report: from JSON to tables, answers and plots.
#include <sstream>

#include "tests/cli/bench_json.h"
#include "tests/cli/cli.h"

namespace ballot::test {
namespace {

class Report : public Cli {
 protected:
  std::string write_json(const std::string& name, const nlohmann::json& json) const { return write(name, json.dump()); }

  /// The cells of the first row whose first cell is `first`, from `heading` on.
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
    ADD_FAILURE() << "no row " << first << " after " << heading << " in:\n" << text;
    return {};
  }

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
  EXPECT_EQ(row(text, "## Table 2", "cut(best)"), (Words{"cut(best)", "", "666.7 (+33.3 %)"}));
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
  if (result.err.find("no plots") != std::string::npos) {
    ASSERT_EQ(std::getenv("CI"), nullptr) << result.err;
    GTEST_SKIP() << result.err;
  }
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
