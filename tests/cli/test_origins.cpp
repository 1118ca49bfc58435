// Tests of `ballot verify --origins`: its table and JSON, and the arguments that it refuses.
#include "tests/cli/cli.h"

namespace ballot::test {
namespace {

using Origins = Cli;

TEST_F(Origins, TheStudyIsPrintedAndWritten) {
  const Result result = succeed({"verify", "--origins", "--quick", "--size", "8x8", "--json", "origins.json"});
  expect_parts(result.out, {"constant 1e-3", "ulp", "pbrt", "bounded", "self hits per million",
                            "lost contacts per million", "offset / size"});
  expect_parts(report("tables origins.json"), {"size; self hits per million", "offset in ulp, largest median"});
  const auto study = json("origins.json");
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
