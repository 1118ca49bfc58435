// Help in two levels: --help has the options that one needs first and fits a screen, --help-all has everything.
#pragma once

#include <CLI/CLI.hpp>
#include <initializer_list>

namespace ballot::cli {

/// Gives the program, and each command that is added to it afterwards, both levels.
void use_two_levels(CLI::App& app);

/// Names the options of a command that --help shows, beside its positional arguments; --help-all shows all. A command
/// without such a list shows all in both. Of a description --help shows the first paragraph, and the names alone of the
/// lines that begin with two spaces and a name.
void show_first(CLI::App& cmd, std::initializer_list<const char*> options);

}  // namespace ballot::cli
