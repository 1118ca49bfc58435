// The devices of a machine, as commands print them.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace ballot::cli {

/// Prints the devices and what each lacks, and marks the one that `wanted` names (ContextOptions::device). Returns them
/// as JSON. Throws Error as list_devices() and choose_device() do.
nlohmann::json print_devices(const std::string& wanted);

}  // namespace ballot::cli
