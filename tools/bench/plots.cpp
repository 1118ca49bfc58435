#include "tools/bench/plots.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <sstream>

#include "engine/ballot.h"

extern char** environ;

namespace ballot::bench {

namespace {

namespace fs = std::filesystem;

constexpr int kNoMatplotlib = 4;  // the scripts' exit code if matplotlib is missing

struct Output {
  int code = -1;  // exit code; -1: the program could not be started
  std::string text;
};

/// Runs a program to its end. Returns its exit code, and standard output and error as one text.
Output run(std::vector<std::string> words) {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) return {};
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
  ::posix_spawn_file_actions_adddup2(&actions, ends[1], STDERR_FILENO);
  std::vector<char*> args;
  for (std::string& word : words) args.push_back(word.data());
  args.push_back(nullptr);
  pid_t child = 0;
  const int error = ::posix_spawnp(&child, args[0], &actions, nullptr, args.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  ::close(ends[1]);
  Output output;
  char bytes[4096];
  for (ssize_t n = 0; error == 0 && (n = ::read(ends[0], bytes, sizeof bytes)) > 0;)
    output.text.append(bytes, std::size_t(n));
  ::close(ends[0]);
  int status = 0;
  if (error == 0 && ::waitpid(child, &status, 0) == child && WIFEXITED(status)) output.code = WEXITSTATUS(status);
  if (output.code == 127) output.code = -1;
  return output;
}

/// Returns the path of a script: in ../share/ballot of the program, as in a bundle, else in the source tree that the
/// program lies in; "" if it is in neither.
fs::path find_script(const std::string& name) {
  std::error_code error;
  const fs::path program = program_file();
  const fs::path bundled = (program.parent_path() / "../share/ballot" / name).lexically_normal();
  if (!program.empty() && fs::exists(bundled, error)) return bundled;
  const fs::path tools = BALLOT_SOURCE_TOOLS;
  return program_lies_in(tools.parent_path()) && fs::exists(tools / name, error) ? tools / name : fs::path();
}

/// Returns the interpreters to try: the one in BALLOT_PYTHON, else the first on the path and then the system's own,
/// which sees Debian's packages.
std::vector<std::string> interpreters() {
  if (const char* python = std::getenv("BALLOT_PYTHON")) return {python};
  return {"python3", "/usr/bin/python3"};
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

}  // namespace

Plots draw_plots(const fs::path& folder, const std::string& script, const std::string& results_name) {
  const fs::path plotter = find_script(script);
  if (plotter.empty())
    return {{},
            fmt::format("no plots: {} is neither in ../share/ballot of the program nor in a source tree around it",
                        script)};
  const std::string results = (folder / results_name).string();
  bool python = false;
  for (const std::string& interpreter : interpreters()) {
    const Output output = run({interpreter, plotter.string(), results, "--out", folder.string()});
    if (output.code == -1) continue;
    python = true;
    if (output.code == kNoMatplotlib) continue;
    const auto lines = lines_of(output.text);
    if (output.code != 0)
      fail(Failure::Work, "{}: drawing the plots of {} failed: {}", plotter.string(), results,
           lines.empty() ? "it printed no message" : lines.back());
    Plots plots;
    for (const std::string& line : lines)
      if (line.starts_with("plot ")) plots.files.push_back(line.substr(5));
    return plots;
  }
  return {
      {},
      fmt::format("no plots: {} is missing; install {} (Debian), then: python3 {} {} --out {}",
                  python ? "matplotlib" : "Python 3", python ? "python3-matplotlib" : "python3 and python3-matplotlib",
                  plotter.string(), results, folder.string())};
}

std::string plot_section(const Plots& plots) {
  std::string text = "## Plots\n\n";
  for (const std::string& file : plots.files)
    text += fmt::format("![{}]({})\n\n", fs::path(file).stem().string(), file);
  if (!plots.missing.empty())
    text += plots.missing + "\n\n";
  else if (plots.files.empty())
    text += "Nothing to draw.\n\n";
  return text;
}

}  // namespace ballot::bench
