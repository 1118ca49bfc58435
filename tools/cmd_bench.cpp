#include "tools/bench/compare.h"
#include "tools/bench/report.h"
#include "tools/cli.h"

namespace ballot::cli {

namespace {

struct Args {
  std::vector<std::string> compare;
  double tolerance = 0.02;
  std::string json;
};

int compare_files(const Args& args) {
  if (!(args.tolerance >= 0 && args.tolerance <= 10))
    fail(Failure::Arguments, "--tolerance: {} is not a share from 0 to 10, such as 0.02", args.tolerance);
  if (!args.json.empty()) check_writable(args.json);
  const auto a = bench::read_documents(args.compare[0]), b = bench::read_documents(args.compare[1]);
  const bench::Comparison comparison = bench::compare(a, b);
  const bool slower = bench::print_comparison(comparison, args.tolerance);
  write_json(args.json, bench::comparison_json(comparison, args.tolerance));
  return slower ? 1 : 0;
}

int run(const Args& args) { return compare_files(args); }

}  // namespace

void add_bench(CLI::App& app, int& result) {
  auto args = std::make_shared<Args>();
  CLI::App* cmd = app.add_subcommand("bench", "methods x ray kinds x numeric modes: speed");
  cmd->add_option("--compare", args->compare, "A.json B.json: is B slower than A beyond noise? exit code 1 if so")
      ->expected(2)
      ->required();
  cmd->add_option("--tolerance", args->tolerance, "share by which B may be slower [0.02]");
  cmd->add_option("--json", args->json, "also write the comparison to this file");
  cmd->callback([args, &result] { result = run(*args); });
}

}  // namespace ballot::cli
