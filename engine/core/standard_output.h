// Standard output as a place for data. Text must not mix with data, so data claims the stream and text moves to
// standard error.
#pragma once

#include <filesystem>
#include <optional>

namespace ballot {

/// Returns the descriptor that a path such as /dev/stdout, /dev/fd/3 or /proc/self/fd/3 names; nothing for other paths.
std::optional<int> descriptor_of(const std::filesystem::path& path);

/// Keeps standard output for data: from now on everything that the process prints there, by whatever library, goes to
/// standard error, and /dev/stdout means the stream that standard output was. A second call does nothing. Not
/// thread-safe: it is meant for the start of a program. Throws Error(Work) if standard output is closed.
void claim_standard_output();

/// Returns the descriptor to which bytes for `descriptor` go: the claimed stream for that of standard output.
int data_descriptor(int descriptor);

}  // namespace ballot
