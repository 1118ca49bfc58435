#include "tools/bench/report.h"
#include "tools/cli.h"

namespace ballot::cli {

namespace {

struct Args {
  std::vector<std::string> files;
  std::string report, readme;
};

int run(const Args& args) {
  if (args.report.empty() && args.readme.empty())
    fail(Failure::Arguments, "report: nowhere to write to; give --report DIR, --readme FILE or both");
  if (!args.readme.empty()) bench::check_readme(args.readme);
  std::vector<bench::Document> documents;
  for (const std::string& file : args.files)
    for (bench::Document& document : bench::read_documents(file)) documents.push_back(std::move(document));
  if (!args.report.empty()) {
    const std::string missing = bench::write_report(args.report, documents);
    if (!missing.empty()) fmt::print(stderr, "ballot: {}\n", missing);
    fmt::print("wrote {}\n", (std::filesystem::path(args.report) / "report.md").string());
  }
  if (!args.readme.empty()) {
    bench::write_readme(args.readme, documents);
    fmt::print("wrote the results in {}\n", args.readme);
  }
  return 0;
}

}  // namespace

void add_report(CLI::App& app, int& result) {
  auto args = std::make_shared<Args>();
  CLI::App* cmd = app.add_subcommand("report", "tables, answers and plots of what 'ballot bench' measured; no device");
  cmd->add_option("FILES", args->files, "JSON of 'ballot bench', or results.json of reports; several devices may mix")
      ->required();
  cmd->add_option("--report", args->report, "folder for report.md, results.json, records.csv and plots");
  cmd->add_option("--readme", args->readme,
                  "replace what this file has between the lines <!-- results:begin --> and <!-- results:end -->");
  cmd->callback([args, &result] { result = run(*args); });
}

}  // namespace ballot::cli
