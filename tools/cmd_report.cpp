#include "tools/bench/readme.h"
#include "tools/bench/report.h"
#include "tools/cli.h"
#include "tools/verify/report.h"

namespace ballot::cli {

namespace {

namespace fs = std::filesystem;

struct ReportArgs {
  std::vector<std::string> files;
  std::string report, readme;
};

/// One sort of runs, measured or verified: the names of its README section and report page, and the functions that
/// write them.
struct Sort {
  std::string place, page;
  std::vector<bench::Document> documents;
  std::string (*write_report)(const fs::path& folder, const std::vector<bench::Document>& documents);
  std::string (*readme_text)(const std::vector<bench::Document>& documents);
};

void write(const ReportArgs& args, const Sort& sort) {
  if (!args.report.empty()) {
    const std::string missing = sort.write_report(args.report, sort.documents);
    if (!missing.empty()) say_aside("ballot: {}\n", missing);
    say("wrote {}\n", (fs::path(args.report) / sort.page).string());
  }
  if (!args.readme.empty()) {
    bench::write_readme(args.readme, sort.place, sort.readme_text(sort.documents));
    say("wrote the {} in {}\n", sort.place, args.readme);
  }
}

int run_report(const ReportArgs& args) {
  if (args.report.empty() && args.readme.empty())
    fail(Failure::Arguments, "report: no output was named; give --report DIR, --readme FILE or both");
  CommandFiles outputs;
  for (const std::string& file : args.files) outputs.reads("FILES", file);
  Sort measured{"results", "report.md", {}, bench::write_report, bench::readme_text};
  Sort verified{"accuracy", "verify.md", {}, verify::write_report, verify::readme_text};
  for (const std::string& file : args.files)
    for (bench::Document& document : bench::read_documents(file))
      (verify::is_verified(document) ? verified : measured).documents.push_back(std::move(document));
  if (!measured.documents.empty()) note_folder(outputs, args.report, bench::kReportFiles);
  if (!verified.documents.empty()) note_folder(outputs, args.report, verify::kReportFiles);
  outputs.writes("--readme", args.readme);
  for (const Sort* sort : {&measured, &verified})
    if (!args.readme.empty() && !sort->documents.empty()) bench::check_readme(args.readme, sort->place);
  for (const Sort* sort : {&measured, &verified})
    if (!sort->documents.empty()) write(args, *sort);
  return 0;
}

}  // namespace

void add_report(CLI::App& app, int& result) {
  auto args = std::make_shared<ReportArgs>();
  CLI::App* cmd = app.add_subcommand(
      "report", "writes tables, answers and plots of results of 'ballot bench' and 'ballot verify'; needs no device");
  cmd->add_option("FILES", args->files,
                  "JSON files of these commands or of their reports; runs on several devices may be mixed;\n"
                  "e.g. ballot report gpu.json cpu.json --report out/report")
      ->required();
  cmd->add_option("--report", args->report,
                  "folder for report.md, results.json, records.csv and plots; for verified runs verify.md,\n"
                  "verify.json, verify.csv and a plot");
  cmd->add_option("--readme", args->readme,
                  "text file in which to replace the section between the lines <!-- results:begin --> and\n"
                  "<!-- results:end -->; for verified runs <!-- accuracy:begin --> and <!-- accuracy:end -->");
  cmd->callback([args, &result] { result = run_report(*args); });
}

}  // namespace ballot::cli
