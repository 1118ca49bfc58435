// What method auto chose, for people and as JSON.
#pragma once

#include <string>
#include <vector>

#include "tools/cli.h"

namespace ballot::cli {

/// Lets auto choose anew for every kind of rays of the first view.
void calibrate(Engine& engine, const std::string& numeric);

/// A table of choices and why; the same as JSON.
nlohmann::json print_choices(const std::vector<Choice>& choices);

/// A line on what auto chose for such rays; empty for other methods.
std::string choice_line(Engine& engine, const Query& query);

}  // namespace ballot::cli
