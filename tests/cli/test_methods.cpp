// Tests of the tables of `ballot methods`: printed, and in the manuals.
#include <fstream>
#include <iterator>

#include "engine/answer/knobs.h"
#include "engine/answer/numeric.h"
#include "engine/tree/formats/formats.h"
#include "tests/cli/cli.h"

namespace ballot::test {
namespace {

class MethodTables : public Cli {};

std::string committed(const std::string& file) {
  std::ifstream in(std::string(BALLOT_SOURCE_DIR) + "/" + file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST_F(MethodTables, ListTheRegistries) {
  const std::string text = succeed({"methods"}).out;
  for (const Method& m : kMethods) expect_parts(text, {m.name, m.summary, m.threshold.knob});
  for (const TreeFormat& f : kTreeFormats) expect_parts(text, {f.name, f.summary});
  for (const KnobInfo& k : knobs()) expect_parts(text, {k.name, k.values, k.what});
  for (const NumericMode& m : kNumericModes) expect_parts(text, {m.name, m.summary});
  for (const Builder& b : kBuilders) expect_parts(text, {b.name, b.summary});
}

TEST_F(MethodTables, TheManualHasThem) {
  const std::string manual = committed("shaders/methods.md");
  for (const char* name : {"methods", "formats", "knobs", "numeric", "builders"})
    EXPECT_NE(manual.find("<!-- " + std::string(name) + ":begin -->"), std::string::npos) << name;
  write("methods.md", manual);
  succeed({"methods", "--write", "methods.md"});
  EXPECT_EQ(read("methods.md"), manual) << "run `ballot methods --write shaders/methods.md`";
}

TEST_F(MethodTables, ReplaceWhatIsBetweenTheMarks) {
  write("page.md", "above\n<!-- numeric:begin -->\nstale\n<!-- numeric:end -->\nbelow\n");
  EXPECT_EQ(succeed({"methods", "--write", "page.md"}).out, "wrote the numeric in page.md\n");
  const std::string page = read("page.md");
  EXPECT_TRUE(page.starts_with("above\n<!-- numeric:begin -->\n\n| mode ")) << page;
  EXPECT_TRUE(page.ends_with("|\n\n<!-- numeric:end -->\nbelow\n")) << page;
  EXPECT_EQ(page.find("stale"), std::string::npos);
}

TEST_F(MethodTables, RefuseFilesWithoutMarks) {
  const std::string stale = "<!-- knobs:begin -->\nstale\n<!-- knobs:end -->\n";
  write("good.md", stale);
  write("none.md", "text\n");
  write("half.md", "<!-- knobs:begin -->\n");
  refuse(1, {"none.md", "found no section", "<!-- methods:begin -->"}, {"methods", "--write", "good.md", "none.md"});
  refuse(1, {"half.md", "found 0 lines '<!-- knobs:end -->'"}, {"methods", "--write", "good.md", "half.md"});
  refuse(1, {"absent.md"}, {"methods", "--write", "good.md", "absent.md"});
  EXPECT_EQ(read("good.md"), stale);
}

}  // namespace
}  // namespace ballot::test
