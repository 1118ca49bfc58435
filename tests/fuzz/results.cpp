// The JSON of `ballot bench` and `ballot verify`, as `ballot report` reads it.
#include "tests/fuzz/fuzz.h"
#include "tools/bench/document.h"

namespace ballot::fuzz {

namespace {

std::vector<std::string> results_seeds() {
  bench::Document document;
  document.device = "llvmpipe";
  document.driver = "Mesa";
  document.subgroup_size = 8;
  document.clock = "wall";
  document.date = "2026-01-01T00:00:00Z";
  document.size = {64, 64};
  document.scenes.push_back({"square", {}, 0.5});
  bench::Record record;
  record.scene = "square";
  record.method = "packet";
  record.accuracy.emplace();
  record.accuracy->cases.emplace_back();
  document.records.push_back(record);
  return {bench::to_json(document).dump(), bench::to_json(std::vector<bench::Document>{document, document}).dump()};
}

std::vector<std::string> results_words() {
  return {"\"documents\"",
          "\"records\"",
          "\"scenes\"",
          "\"device\"",
          "\"cases\"",
          "\"hard\"",
          "\"views\"",
          "null",
          "true",
          "1e308",
          "1e999",
          "-1",
          "18446744073709551616",
          "[[[[",
          "\"t_ulp\"",
          "\"verified_rays\"",
          "\\ud800"};
}

void read_results(std::string_view input) {
  const std::filesystem::path path = put("results.json", input);
  expect_plain([&] { bench::to_json(bench::read_documents(path.string())); });
}

}  // namespace

Target results_target() { return {"results", Form::Json, results_seeds(), results_words(), read_results}; }

}  // namespace ballot::fuzz
