#include "tools/verify/report.h"

#include <algorithm>

#include "tools/bench/plots.h"
#include "tools/bench/report.h"
#include "tools/verify/tables.h"

namespace ballot::verify {

namespace {

namespace fs = std::filesystem;
using bench::Document;

constexpr std::size_t kListed = 4;  // most wrong answers that the report lists for one entry on one kind of rays

constexpr std::string_view kLegend =
    "Every answer is checked against an oracle that decides exactly for float32 input. Wrong answers are false misses, "
    "false hits\nand wrong prims; those \"beyond bound\" are not explained by the proved bound of the mode's rounding "
    "errors. A tie is an answer\nthat names another triangle at exactly the same t. A wrong value is a t, u or v "
    "beyond "
    "the bound. \"t ulp\" is the error of t\nin units in the last place of float32 at the exact t, over answers that "
    "name the right triangle; the figure is the largest of\nall views. A self hit is a hit of the triangle that the "
    "ray "
    "started from. Image RMSE is the error of a picture whose shade is\nthe cosine between ray and geometric normal."
    "\n\n";

std::string section(const std::string& heading, const std::string& intro, const std::string& body) {
  return body.empty() ? ""
                      : "## " + heading + "\n\n" + (intro.empty() ? "" : intro + "\n\n") + body +
                            (body.ends_with("\n\n") ? "" : "\n");
}

std::string mode_section(const std::vector<Platform>& platforms) {
  std::string base;
  for (const Platform& p : platforms) {
    const std::string one = "`" + base_mode(p) + "`" + (platforms.size() > 1 ? " on " + p.name : "");
    base += (base.empty() ? "" : ", ") + one;
  }
  return section("What a mode costs, and how often it errs",
                 "Time is that of the traversal alone, relative to " + base +
                     ", over all scenes, ray kinds and methods that have both. Rates are over all answers.",
                 mode_table(platforms));
}

std::string rate_section(const std::vector<Platform>& platforms) {
  return section(
      "Wrong answers per million rays",
      "The rate of the method that errs most. In brackets: the rate of answers beyond the bound of the mode's "
      "arithmetic.",
      rate_table(platforms));
}

std::string verdicts(const std::vector<Document>& documents) {
  std::string text;
  for (const Document& d : documents) text += fmt::format("- {}: {}\n", d.device, verdict(d));
  return text;
}

std::string hard_sections(const std::vector<Document>& documents, bool brief) {
  std::string text;
  for (const Document& d : documents) {
    if (d.hard.empty()) continue;
    const std::string name = documents.size() > 1 ? ": " + d.device : "";
    const std::string intro =
        "For each mode, the method with the most wrong answers. Bold marks answers that the mode promises not to give. "
        "A "
        "leak is a ray that escapes from a closed mesh. Answers that differ depend on the method.";
    if (brief)
      text += section("Hard cases" + name, intro, hard_summary(d.hard));
    else
      text += section("Hard cases" + name, intro, hard_table(d.hard)) + hard_list(d.hard);
  }
  return text;
}

std::string place_sections(const std::vector<Platform>& platforms) {
  std::string text;
  for (const Platform& p : platforms) {
    std::string tables;
    for (const Place& place : p.places) tables += place_table(place);
    text += section("Speed against error: " + p.name, "", tables);
  }
  return text;
}

}  // namespace

bool is_verified(const Document& document) {
  return !document.hard.empty() ||
         std::ranges::any_of(document.records, [](const bench::Record& r) { return r.accuracy.has_value(); });
}

void check_report_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) fail(Failure::Work, "--report {}: cannot create the folder: {}", folder.string(), error.message());
  for (const char* file : kReportFiles) check_writable(folder / file);
}

std::string write_report(const fs::path& folder, const std::vector<Document>& documents) {
  check_report_folder(folder);
  write_file(folder / "verify.json", json_text(bench::to_json(documents)), Links::Replace);
  write_file(folder / "verify.csv", verify::csv_text(documents), Links::Replace);
  const std::vector<Platform> platforms = platforms_of(documents);
  const std::string main = "# Speed against error, measured\n\n" + verdicts(documents) + "\n" +
                           bench::setup_section(documents, bench::arrange(documents)) + std::string(kLegend) +
                           mode_section(platforms) + rate_section(platforms);
  const std::string details =
      hard_sections(documents, false) + place_sections(platforms) +
      section("Examples of wrong answers and their reasons", "", case_list(platforms, documents, kListed));
  write_file(folder / "verify.md", main + details, Links::Replace);  // the tables are there even if drawing fails
  if (platforms.empty()) return "";
  const bench::Plots plots = bench::draw_plots(folder, "plot_verify.py", "verify.json");
  write_file(folder / "verify.md", main + bench::plot_section(plots) + details, Links::Replace);
  return plots.missing;
}

std::string readme_text(const std::vector<Document>& documents) {
  const std::vector<Platform> platforms = platforms_of(documents);
  std::string text = verdicts(documents) + "\n";
  if (!platforms.empty()) text += mode_section(platforms) + rate_section(platforms);
  return text + hard_sections(documents, true) + section("How it was measured", "", bench::runs_text(documents));
}

}  // namespace ballot::verify
