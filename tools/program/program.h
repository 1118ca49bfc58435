#pragma once

namespace ballot::cli {

/// Runs the command line `argv` and returns the exit code. Ignores SIGPIPE and SIGXFSZ from then on.
int program(int argc, char** argv);

}  // namespace ballot::cli
