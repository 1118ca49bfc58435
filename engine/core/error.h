// The exception of Ballot.
#pragma once

#include <fmt/format.h>

#include <stdexcept>
#include <string>

namespace ballot {

/// The kind of a failure; the value is the program's exit code.
enum class Failure {
  Work = 1,       // bad input file, disk, out of memory, lost device
  Arguments = 2,  // the command line or a call's arguments are wrong
  Device = 3,     // no usable Vulkan device, or no layer, display or CUDA device where one is asked for
};

/// The exception for failures that a user can meet. what() says what failed, where, what was found, what was expected,
/// and what to do.
class Error : public std::runtime_error {
 public:
  Error(Failure kind, const std::string& text) : std::runtime_error(text), kind_(kind) {}
  Failure kind() const { return kind_; }

 private:
  Failure kind_;
};

/// Throws Error with a formatted text.
template <class... Args>
[[noreturn]] void fail(Failure kind, fmt::format_string<Args...> text, Args&&... args) {
  throw Error(kind, fmt::format(text, std::forward<Args>(args)...));
}

}  // namespace ballot
