// The command line: ballot info | render | merge | trace | distance | inside | check | view | bench | verify |
// methods | shaders | selftest.
#include "tools/program/program.h"

#include <csignal>
#include <cstdio>
#include <exception>
#include <sstream>

#include "tools/program/cli.h"
#include "tools/program/help.h"
#include "tools/program/interrupt.h"

namespace ballot::cli {

namespace {

/// The commands, in the order of the help.
constexpr void (*kCommands[])(CLI::App& app, int& result) = {
    add_info, add_render, add_merge,  add_trace,   add_distance, add_inside,  add_check,
    add_view, add_bench,  add_verify, add_methods, add_shaders,  add_selftest};

std::string commands_of(const CLI::App& app) {
  std::string names;
  for (const CLI::App* each : app.get_subcommands([](const CLI::App*) { return true; }))
    names += fmt::format("{}{}", names.empty() ? "" : ", ", each->get_name());
  return names;
}

/// Refuses an unknown command and lists those that exist; CLI11 would only say that a command is required.
void check_command(const CLI::App& app, std::string_view word) {
  if (app.get_subcommands([&](const CLI::App* each) { return each->get_name() == word; }).empty())
    fail(Failure::Arguments, "there is no command '{}'; the commands are: {}", word, commands_of(app));
}

/// Returns what is wrong with arguments that a command does not take.
std::string in_words(const std::vector<std::string>& extras) {
  for (const std::string& extra : extras)
    if (extra.starts_with('-')) return fmt::format("there is no option '{}'", extra.substr(0, extra.find('=')));
  return fmt::format("'{}' is one argument too many", extras.empty() ? "" : extras.front());
}

/// Returns what is wrong with the command line, as the beginning of a sentence.
std::string in_words(const CLI::ParseError& error) {
  const std::string text = error.what();
  switch (CLI::ExitCodes(error.get_exit_code())) {
    case CLI::ExitCodes::RequiredError:
      return text.starts_with("A subcommand") ? "no command given"
                                              : "missing " + text.substr(0, text.find(" is required"));
    case CLI::ExitCodes::ConversionError:
      return "a value has the wrong type" + text.substr(text.find(':'));
    case CLI::ExitCodes::ArgumentMismatch:
      return text.substr(0, text.find(':')) + " needs a value";
    default:
      return text;
  }
}

/// Prints why the program ends.
void say_failure(std::string_view text) { say_aside("ballot: {}\n", text); }

int run(int argc, char** argv) {
  CLI::App app(
      "Ballot is a ray tracer of GLSL compute kernels for any Vulkan 1.2 device, GPU or CPU.\n"
      "The lanes of a subgroup vote on the next step of their traversal; --method chooses the traversal method.",
      "ballot");
  app.require_subcommand(1);
  app.set_version_flag("--version", fmt::format("ballot {}, commit {}", BALLOT_VERSION, commit()),
                       "shows version and commit");
  const char* footer =
      "Examples:\n"
      "  ballot info scenes/cornell.gltf\n"
      "  ballot render scenes/cornell.gltf --view all --size 512x512 --png --out out/\n"
      "  ballot trace scenes/cornell.gltf --rays rays.npy --out hits.npy --method packet --knob vote=count\n"
      "  ballot view scenes/cornell.gltf --method packet --shading heat --heat lanes\n"
      "  ballot bench scenes/cornell.gltf --rays primary,ao --sweep --json bench.json\n"
      "  ballot verify scenes/cornell.gltf --rays primary --json verify.json\n"
      "Exit codes: 0 done, 1 the work failed, 2 the arguments are wrong, 3 no usable device.";
  use_two_levels(app);
  int result = 0;
  for (const auto add : kCommands) add(app, result);
  app.footer(footer);  // here, so that commands do not inherit it
  if (argc > 1 && argv[1][0] != '-') check_command(app, argv[1]);
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& help) {  // or version
    std::ostringstream text, errors;
    app.exit(help, text, errors);
    say("{}", text.str());
    return 0;
  } catch (const CLI::ParseError& error) {
    const auto chosen = app.get_subcommands();
    const std::string name = chosen.empty() ? "" : chosen.front()->get_name();
    const bool extra = CLI::ExitCodes(error.get_exit_code()) == CLI::ExitCodes::ExtrasError;
    say_failure(fmt::format("{}{}; {}", name.empty() ? "" : name + ": ",
                            extra ? in_words(app.remaining(true)) : in_words(error),
                            name.empty() ? "give one of: " + commands_of(app) + "; 'ballot --help' explains them"
                                         : "'ballot " + name + " --help' lists the arguments"));
    return int(Failure::Arguments);
  }
  return result;
}

}  // namespace

int program(int argc, char** argv) {
  // A full disk and a closed pipe are errors of the write, with a message, instead of the end of the process.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  spare_address_space();
  remember_reads();
  std::setvbuf(stdout, nullptr, _IOLBF, BUFSIZ);  // a log grows line by line
  try {
    set_command_line(argc, argv);
    const int code = run(argc, argv);
    flush_text();
    return code;
  } catch (const Stopped& stopped) {
    say_failure(stopped.what());
    return stopped.exit_code();
  } catch (...) {
    const FailureText failure = failure_text();
    say_failure(failure.text);
    return int(failure.kind);
  }
}

}  // namespace ballot::cli
