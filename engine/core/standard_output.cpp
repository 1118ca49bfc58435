#include "engine/core/standard_output.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstdio>
#include <string>
#include <string_view>
#include <system_error>

#include "engine/core/error.h"

namespace ballot {
namespace {

int claimed_output = -1;  // a copy of what standard output was

}  // namespace

std::optional<int> descriptor_of(const std::filesystem::path& path) {
  const std::string text = path.string();
  if (text == "/dev/stdin") return STDIN_FILENO;
  if (text == "/dev/stdout") return STDOUT_FILENO;
  if (text == "/dev/stderr") return STDERR_FILENO;
  for (const std::string_view folder : {"/dev/fd/", "/proc/self/fd/"}) {
    if (!text.starts_with(folder)) continue;
    int number = -1;
    const char* end = text.data() + text.size();
    const auto [rest, error] = std::from_chars(text.data() + folder.size(), end, number);
    if (error == std::errc{} && rest == end && number >= 0) return number;
  }
  return std::nullopt;
}

void claim_standard_output() {
  if (claimed_output >= 0) return;
  std::fflush(stdout);
  claimed_output = ::fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, 3);
  if (claimed_output < 0 || ::dup2(STDERR_FILENO, STDOUT_FILENO) < 0)
    fail(Failure::Work, "cannot write standard output: {}", std::generic_category().message(errno));
}

int data_descriptor(int descriptor) {
  return descriptor == STDOUT_FILENO && claimed_output >= 0 ? claimed_output : descriptor;
}

}  // namespace ballot
