// Tests of `ballot verify --origins`: its tables, JSON and report, and the arguments that it refuses.
#include "tests/cli/cli.h"

namespace ballot::test {
namespace {

using Origins = Cli;

TEST_F(Origins, TheStudyIsPrintedAndWritten) {
  const Result result =
      succeed({"verify", "--origins", "--quick", "--size", "8x8", "--json", "origins.json", "--report", "out"},
              {{"BALLOT_PYTHON", "/nowhere"}});
  expect_parts(result.out, {"constant 1e-3", "ulp", "pbrt", "bounded", "Self hits per million rays",
                            "Lost contacts per million rays", "Offset / size", "wrote out/origins.md"});
  expect_parts(read("out/origins.md"), {"Self hits per million rays", "no plots", "plot_origins.py out/origins.json"});
  const auto study = json("origins.json");
  EXPECT_EQ(study, json("out/origins.json"));
  EXPECT_EQ(study["records"].size(), 8u * 3 * 2 * 2);
  for (const auto& record : study["records"]) {
    EXPECT_GT(record["rays"].get<std::uint64_t>(), 0u);
    EXPECT_GT(record["offset_share"].get<double>(), 0);
    const bool safe = record["policy"] == "bounded" || record["policy"] == "proved";
    EXPECT_TRUE(!safe || record["self_hits"] == 0) << record;
  }
}

TEST_F(Origins, WhatTheStudyHasNoUseForIsRefused) {
  refuse(2, {"--origins is a study of its own scenes"}, {"verify", "--origins", "--hard"});
  refuse(2, {"--origins is a study of its own scenes"}, {"verify", square(), "--origins"});
  refuse(2, {"8xx8"}, {"verify", "--origins", "--size", "8xx8"});
}

}  // namespace
}  // namespace ballot::test
