// The JSON file of views.
#include "tests/fuzz/fuzz.h"
#include "tools/program/views_file.h"

namespace ballot::fuzz {

namespace {

std::vector<std::string> views_seeds() {
  View straight, plan;
  straight.name = "door";
  plan.name = "plan";
  plan.orthographic = true;
  plan.ymag = 2;
  const std::filesystem::path path = folder() / "views-seed.json";
  cli::write_views(path, {straight, plan});
  return {bytes_in(path),
          R"({"views": [{"name": "a", "position": [0, 1, 2], "orientation": [0, 0, 0, 1], "yfov": 1}]})"};
}

std::vector<std::string> views_words() {
  return {"\"views\"", "\"name\"", "\"position\"", "\"orientation\"", "\"yfov\"",
          "\"ymag\"",  "null",     "1e308",        "1e999",           "\\ud800"};
}

void read_views(std::string_view input) {
  const std::filesystem::path path = put("views.json", input);
  expect_plain([&] {
    const std::vector<View> views = cli::read_views(path);
    for (const View& view : views) cli::as_written(view);
    cli::write_views(path, views);
    if (cli::read_views(path).size() != views.size()) finding("views that do not come back", input);
  });
}

}  // namespace

Target views_target() { return {"views", Form::Json, views_seeds(), views_words(), read_views}; }

}  // namespace ballot::fuzz
