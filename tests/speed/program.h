// Code that the programs in tests/speed share.
#pragma once

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <vector>

#include "tools/bench/document.h"

namespace ballot::speed {

inline double median(const std::vector<double>& values) { return bench::quantile(values, 0.5); }

/// Parses the arguments and calls run(). Returns the exit code: 0, 1 if the work failed, 2 if the arguments are wrong.
template <class Run>
int run_program(CLI::App& app, int argc, char** argv, const char* name, const Run& run) {
  try {
    app.parse(argc, argv);
    run();
    return 0;
  } catch (const CLI::ParseError& e) {
    return app.exit(e) ? 2 : 0;
  } catch (const std::exception& e) {
    fmt::print(stderr, "{}: {}\n", name, e.what());
    return 1;
  }
}

}  // namespace ballot::speed
