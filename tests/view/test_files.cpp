// Tests of views files.
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/temporary.h"
#include "tools/program/views_file.h"

namespace {

using namespace ballot;
namespace fs = std::filesystem;

View some_view(const std::string& name, double angle) {
  View v;
  v.name = name;
  v.yfov = 0.9;
  v.world_from_camera = cli::frame_of({1.0 / 3, -2, 1e-7}, glm::angleAxis(angle, glm::normalize(glm::dvec3(1, 2, 3))));
  return v;
}

TEST(ViewsFile, ReadsBackWhatItWrote) {
  const test::TemporaryFolder folder;
  const fs::path file = folder.path() / "views.json";
  for (const double angle : {0.0, 0.3, 1.7, 3.1}) {
    const View view = cli::as_written(some_view("a", angle));
    cli::write_views(file, {view});
    const View read = cli::read_views(file).at(0);
    // The file holds a pose, so a view that was made from one comes back equal up to rounding errors.
    for (int c = 0; c < 4; ++c)
      for (int r = 0; r < 4; ++r) EXPECT_NEAR(read.world_from_camera[c][r], view.world_from_camera[c][r], 1e-15);
    EXPECT_EQ(read.world_from_camera[3], view.world_from_camera[3]);
    EXPECT_EQ(read.yfov, view.yfov);
  }
}

TEST(ViewsFile, AppendsAndRefusesANameThatIsTaken) {
  const test::TemporaryFolder folder;
  const fs::path file = folder.path() / "append.json";
  cli::append_view(file, some_view("a", 1));
  cli::append_view(file, some_view("b", 2));
  EXPECT_EQ(cli::read_views(file).size(), 2u);
  EXPECT_THROW(cli::append_view(file, some_view("a", 3)), Error);
  EXPECT_EQ(cli::read_views(file).size(), 2u);
}

TEST(ViewsFile, KeepsOrthographicViews) {
  const test::TemporaryFolder folder;
  const fs::path file = folder.path() / "ortho.json";
  View v = some_view("o", 1);
  v.orthographic = true, v.ymag = 2.5;
  cli::write_views(file, {v});
  EXPECT_TRUE(cli::read_views(file)[0].orthographic);
  EXPECT_EQ(cli::read_views(file)[0].ymag, 2.5);
}

TEST(ViewsFile, SaysWhatIsWrong) {
  const test::TemporaryFolder folder;
  const fs::path file = folder.path() / "bad.json";
  const std::pair<const char*, const char*> kBad[] = {
      {"nonsense", "no views file"},
      {"{\"views\": []}", "no view"},
      {R"({"views": [{"name": "a", "position": [0, 0, 0], "orientation": [0, 0, 0, 2], "yfov": 1}]})",
       "unit quaternion"},
      {R"({"views": [{"name": "a", "position": [0, 0, 0], "orientation": [0, 0, 0, 1], "yfov": 9}]})", "yfov"},
      {R"({"views": [{"name": "a", "position": [0, 0], "orientation": [0, 0, 0, 1], "yfov": 1}]})", "no views file"},
      {R"({"views": [{"name": "a", "position": [0, 0, 0], "orientation": [0, 0, 0, 1], "yfov": 1},
                     {"name": "a", "position": [0, 0, 0], "orientation": [0, 0, 0, 1], "yfov": 1}]})",
       "two views"},
  };
  for (const auto& [text, says] : kBad) {
    write_file(file, std::string_view(text));
    try {
      cli::read_views(file);
      ADD_FAILURE() << text;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(says), std::string::npos) << error.what();
    }
  }
}

}  // namespace
