// The choices of method auto, as text and as JSON.
#pragma once

#include <string>
#include <vector>

#include "tools/cli.h"

namespace ballot::cli {

/// Discards the choices of method auto and lets it choose again, in numeric mode `numeric`, for every ray kind of the
/// scene's first view. Draws a progress bar.
void calibrate(Engine& engine, const std::string& numeric);

/// Prints a table of the choices with the speeds that decided them. Returns the same as JSON.
nlohmann::json print_choices(const std::vector<Choice>& choices);

/// Returns a line that says what auto chose for this query's ray class; empty if the query names another method.
std::string choice_line(Engine& engine, const Query& query);

}  // namespace ballot::cli
